//! Room in lists whose length is that of the pairs: what they grow to, and not twice as much.

/// Makes room in a list whose elements nobody needs any more, where it has none for `count`: for a quarter more, but not for more than `most`
/// unless they are needed.
pub(super) fn make_room<T>(list: &mut Vec<T>, count: usize, most: usize) {
    if list.capacity() < count {
        // The old one goes first, so that both are never there.
        *list = Vec::new();
        list.reserve_exact((count + count / 4).min(most).max(count));
    }
}

#[cfg(test)]
mod tests {
    use super::make_room;

    #[test]
    fn a_list_grows_by_a_quarter_within_what_is_allowed_and_keeps_the_room_that_it_has() {
        let mut list: Vec<u64> = Vec::new();
        for (count, most, expected) in
            [(0, 100, 0), (100, 110, 110), (110, 110, 110), (60, 60, 110), (200, 150, 200)]
        {
            make_room(&mut list, count, most);
            assert_eq!(list.capacity(), expected, "{count} of {most}");
        }
        make_room(&mut list, 1000, usize::MAX);
        assert_eq!(list.capacity(), 1250);
    }
}

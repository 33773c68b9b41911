//! Memory that reading a mesh file takes: room for what was counted, and what lines and polygons take beside it.

use super::{numbers::line_length, polygon::MOST_CORNERS};

/// A vector that grows has at most so many times the bytes of its elements, while it is copied.
pub(super) const GROWTH: u64 = 3;
/// Bytes for what does not grow with a file: words of a header, a name.
pub(super) const BESIDE: u64 = 1 << 10;
/// Bytes of a point.
pub(super) const POINT: u64 = 24;
/// Bytes of the texture coordinates of a point.
pub(super) const UV: u64 = 16;
/// Bytes of the mass of a point.
pub(super) const MASS: u64 = 8;
/// Bytes of a triangle.
pub(super) const TRIANGLE: u64 = 12;
/// Bytes of a spring: as it is kept, and its points and its place while repeats are looked for.
pub(super) const SPRING: u64 = 48 + 12;

/// Bytes of a corner of the face that is being read: as it was read, and as it is cut.
const CORNER: u64 = 4 + 4;
/// Bytes that cutting the ears of a polygon keeps of each corner.
const EAR: u64 = 48;
/// Bytes of a word of the line that is being read.
const WORD: u64 = 16;
/// Words that a line is taken to have without a look.
const FEW_WORDS: usize = 64;

/// Bytes that faces of at most so many corners take while they are read, beside their triangles.
pub(super) fn corner_bytes(corners: usize) -> u64 {
    GROWTH * (CORNER * corners as u64 + EAR * corners.min(MOST_CORNERS) as u64)
}

/// The widest of some lines.
#[derive(Clone, Copy, Debug)]
pub(super) struct Widest(usize);

impl Default for Widest {
    fn default() -> Self {
        Self(FEW_WORDS)
    }
}

impl Widest {
    /// Looks at a line. A word and what ends it have two bytes: the words of a short line are not counted.
    pub(super) fn see(&mut self, line: &[u8]) {
        if line.len() > 2 * self.0 {
            self.see_words(words(line));
        }
    }

    /// Looks at a line of so many words.
    pub(super) fn see_words(&mut self, words: usize) {
        self.0 = self.0.max(words);
    }

    /// Bytes that such a line takes while it is read as words, and as the corners of a face.
    pub(super) fn bytes(self) -> u64 {
        GROWTH * WORD * self.0 as u64 + corner_bytes(self.0)
    }
}

/// Lines of a text that are not empty, whatever ends them.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = bytes;
    let line = move || {
        if rest.is_empty() {
            return None;
        }
        let (line, after) = rest.split_at(line_length(rest));
        rest = after.get(1..).unwrap_or_default();
        Some(line)
    };
    std::iter::from_fn(line).filter(|line| !line.is_empty())
}

/// Words of a line.
pub(super) fn words(line: &[u8]) -> usize {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).count()
}

/// Makes room for elements that were counted. Where there is no memory for them the vector grows as it is filled: a file
/// of so many lines without numbers is refused at the first of them.
pub(super) fn make_room<T>(target: &mut Vec<T>, count: usize) {
    let _ = target.try_reserve_exact(count);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_of_the_widest_line_are_known_whatever_stands_between_them() {
        for count in [1, FEW_WORDS, FEW_WORDS + 1, 1000] {
            for between in [" ", "\t \t"] {
                let mut widest = Widest::default();
                widest.see(vec!["0"; count].join(between).as_bytes());
                widest.see(b"1 2 3");
                assert_eq!(widest.0, count.max(FEW_WORDS), "{count} {between:?}");
            }
        }
    }

    #[test]
    fn room_that_no_memory_has_is_not_made_and_nothing_panics() {
        let mut points: Vec<[f64; 3]> = Vec::new();
        make_room(&mut points, usize::MAX / 2);
        assert_eq!(points.capacity(), 0);
        make_room(&mut points, 7);
        assert_eq!(points.capacity(), 7);
    }
}

//! The one parallel loop: the blocks of a body, the part that each has of some fields, and the threads that share them.
//!
//! Rayon sees one function, which is compiled once: it divides a range of blocks into pieces, and calls what is to be done
//! with a piece through a pointer. What is done with a block is compiled into the loop over a piece.
#![allow(unsafe_code, reason = "what the borrow checker cannot see: ranges of distinct blocks do not meet")]

use std::ops::Range;

use rayon::prelude::*;

use super::{block_count, disjoint::Disjoint};
use crate::math::LANES;

/// The blocks that are computed here, to cut fields by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Own {
    first: usize,
    end: usize,
    /// Particles per block.
    size: usize,
    /// Blocks that a thread takes, at least, if there are as many.
    least_piece: usize,
}

impl Own {
    /// Some of the blocks of a body, of `size` particles each.
    pub(crate) fn of(blocks: Range<usize>, size: usize) -> Self {
        Self { first: blocks.start, end: blocks.end, size, least_piece: 1 }
    }

    /// All blocks of `size` rows that `count` rows fill.
    pub(crate) fn whole(count: usize, size: usize) -> Self {
        Self::of(0..block_count(count, size), size)
    }

    /// The same blocks, of which a thread takes `least_piece` or more, if there are as many.
    pub(crate) fn in_pieces_of(self, least_piece: usize) -> Self {
        Self { least_piece, ..self }
    }

    /// Calls `work(block, part)` for each block, by all threads: blocks are counted over the whole body, and the part of a
    /// block is what it has of `parts`.
    pub(crate) fn each<P: Parts>(&self, parts: P, work: impl Fn(usize, P::Part) + Sync) {
        self.each_with(|| (), parts, |(), block, part| work(block, part));
    }

    /// The same with scratch memory, `work(scratch, block, part)`: it is made for a piece of the blocks, and holds what the
    /// block before has left.
    pub(crate) fn each_with<S, P: Parts>(
        &self,
        scratch: impl Fn() -> S + Sync,
        parts: P,
        work: impl Fn(&mut S, usize, P::Part) + Sync,
    ) {
        let Self { first, end, size, least_piece } = *self;
        run(first..end, least_piece, &move |blocks: Range<usize>| {
            let mut scratch = scratch();
            for block in blocks {
                // SAFETY: pieces do not meet, and a piece names each of its blocks once.
                let part = unsafe { parts.part(block, size) };
                work(&mut scratch, block, part);
            }
        });
    }

    /// What is its of a list with an element per block.
    pub(crate) fn blocks<'a, T>(&self, list: &'a [T]) -> &'a [T] {
        &list[self.first..self.end]
    }

    fn range(&self, size: usize, length: usize) -> Range<usize> {
        (self.first * size).min(length)..(self.end * size).min(length)
    }

    /// What is its of a field with an element per particle.
    pub(crate) fn rows<'a, T>(&self, field: &'a [T]) -> &'a [T] {
        &field[self.range(self.size, field.len())]
    }

    /// What is its of a field with an element per sixteen particles.
    pub(crate) fn groups<'a, T>(&self, field: &'a [T]) -> &'a [T] {
        &field[self.range(self.size / LANES, field.len())]
    }
}

/// Divides a range among the threads of the pool that works now: into as many pieces as there are threads, and a piece that
/// another thread took into as many again. None is shorter than `least_piece`, unless all are.
fn run(range: Range<usize>, least_piece: usize, work: &(dyn Fn(Range<usize>) + Sync)) {
    let halves = |piece: Range<usize>| {
        let half = piece.len() / 2;
        if half < least_piece.max(1) {
            return (piece, None);
        }
        let middle = piece.start + half;
        (piece.start..middle, Some(middle..piece.end))
    };
    rayon::iter::split(range, halves).for_each(work);
}

/// Does both, on two threads where another one is free; returns what each gives.
pub(crate) fn join<A: Send, B: Send>(
    left: impl FnOnce() -> A + Send,
    right: impl FnOnce() -> B + Send,
) -> (A, B) {
    rayon::join(left, right)
}

/// How many threads share what is divided now.
pub(crate) fn thread_count() -> usize {
    rayon::current_num_threads()
}

/// The number of the thread that asks, among these; 0 of one that is none of them.
pub(crate) fn thread_number() -> usize {
    rayon::current_thread_index().unwrap_or(0)
}

/// Does work on so many threads.
#[cfg(test)]
pub(crate) fn on_threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("a pool of few threads");
    pool.install(work)
}

/// Sorts by all threads. Equal elements may change places.
pub(super) fn sort<T: Ord + Send>(list: &mut [T]) {
    list.par_sort_unstable();
}

/// Fields that are cut by blocks: one, or a tuple, an array or an option of such.
pub(crate) trait Parts: Sync {
    /// What a block has of them.
    type Part;

    /// The part of a block, where blocks have `size` rows.
    ///
    /// # Safety
    /// Each block is asked for once at most.
    unsafe fn part(&self, block: usize, size: usize) -> Self::Part;
}

/// A field of which a block has as many elements as every other, but for the last.
pub(crate) struct Cut<S> {
    field: S,
    width: Width,
}

/// How many elements a block has.
#[derive(Clone, Copy)]
enum Width {
    Rows,
    Sixteens,
    Fixed(usize),
}

impl Width {
    /// The elements of a block, those of a field of `length` elements. Ranges of distinct blocks do not meet.
    fn range(self, block: usize, size: usize, length: usize) -> Range<usize> {
        let width = match self {
            Self::Rows => size,
            Self::Sixteens => size / LANES,
            Self::Fixed(width) => width,
        };
        (block * width).min(length)..((block + 1) * width).min(length)
    }
}

/// A field with an element per row.
pub(crate) fn per_row<T>(field: &[T]) -> Cut<&[T]> {
    Cut { field, width: Width::Rows }
}

/// The same, to be written.
pub(crate) fn per_row_mut<T>(field: &mut [T]) -> Cut<Disjoint<'_, T>> {
    Cut { field: Disjoint::new(field), width: Width::Rows }
}

/// A field with an element per sixteen rows.
pub(crate) fn per_sixteen<T>(field: &[T]) -> Cut<&[T]> {
    Cut { field, width: Width::Sixteens }
}

/// The same, to be written.
pub(crate) fn per_sixteen_mut<T>(field: &mut [T]) -> Cut<Disjoint<'_, T>> {
    Cut { field: Disjoint::new(field), width: Width::Sixteens }
}

/// A list with `width` elements per block.
pub(crate) fn several_per_block<T>(list: &[T], width: usize) -> Cut<&[T]> {
    Cut { field: list, width: Width::Fixed(width) }
}

/// The same, to be written.
pub(crate) fn several_per_block_mut<T>(list: &mut [T], width: usize) -> Cut<Disjoint<'_, T>> {
    Cut { field: Disjoint::new(list), width: Width::Fixed(width) }
}

impl<'a, T: Sync> Parts for Cut<&'a [T]> {
    type Part = &'a [T];

    unsafe fn part(&self, block: usize, size: usize) -> &'a [T] {
        &self.field[self.width.range(block, size, self.field.len())]
    }
}

impl<'a, T: Send> Parts for Cut<Disjoint<'a, T>> {
    type Part = &'a mut [T];

    unsafe fn part(&self, block: usize, size: usize) -> &'a mut [T] {
        let range = self.width.range(block, size, self.field.len());
        // SAFETY: ranges of distinct blocks do not meet, and the caller asks for each block once.
        unsafe { self.field.range(range) }
    }
}

/// A list with an element per block.
pub(crate) struct One<S>(S);

/// A list with an element per block.
pub(crate) fn per_block<T>(list: &[T]) -> One<&[T]> {
    One(list)
}

/// The same, to be written.
pub(crate) fn per_block_mut<T>(list: &mut [T]) -> One<Disjoint<'_, T>> {
    One(Disjoint::new(list))
}

impl<'a, T: Sync> Parts for One<&'a [T]> {
    type Part = &'a T;

    unsafe fn part(&self, block: usize, _: usize) -> &'a T {
        &self.0[block]
    }
}

impl<'a, T: Send> Parts for One<Disjoint<'a, T>> {
    type Part = &'a mut T;

    unsafe fn part(&self, block: usize, _: usize) -> &'a mut T {
        // SAFETY: the caller asks for each block once.
        unsafe { self.0.slot(block) }
    }
}

/// A list of which a block has what stands from its start to that of the next.
pub(crate) struct Between<'a, T> {
    list: Disjoint<'a, T>,
    starts: &'a [u32],
    /// Elements for each one that starts count.
    width: usize,
}

/// A list to be written, of which a block has the elements from `starts[block]` to `starts[block + 1]`.
///
/// # Panics
/// Unless starts ascend.
pub(crate) fn between_mut<'a, T>(list: &'a mut [T], starts: &'a [u32]) -> Between<'a, T> {
    several_between_mut(list, starts, 1)
}

/// The same with `width` elements for each one that starts count.
pub(crate) fn several_between_mut<'a, T>(
    list: &'a mut [T],
    starts: &'a [u32],
    width: usize,
) -> Between<'a, T> {
    assert!(starts.is_sorted(), "blocks stand one after another");
    Between { list: Disjoint::new(list), starts, width }
}

impl<'a, T: Send> Parts for Between<'a, T> {
    type Part = &'a mut [T];

    unsafe fn part(&self, block: usize, _: usize) -> &'a mut [T] {
        let [start, end] = [block, block + 1].map(|block| self.starts[block] as usize * self.width);
        let range = start..end;
        // SAFETY: starts ascend, so that ranges of distinct blocks do not meet, and the caller asks for each block once.
        unsafe { self.list.range(range) }
    }
}

impl<P: Parts> Parts for Option<P> {
    type Part = Option<P::Part>;

    unsafe fn part(&self, block: usize, size: usize) -> Self::Part {
        // SAFETY: the caller asks for each block once.
        self.as_ref().map(|parts| unsafe { parts.part(block, size) })
    }
}

impl<P: Parts, const N: usize> Parts for [P; N] {
    type Part = [P::Part; N];

    unsafe fn part(&self, block: usize, size: usize) -> Self::Part {
        // SAFETY: the caller asks for each block once.
        self.each_ref().map(|parts| unsafe { parts.part(block, size) })
    }
}

macro_rules! parts_of_tuples {
    ($(($($parts:ident $place:tt),+))+) => {$(
        impl<$($parts: Parts),+> Parts for ($($parts,)+) {
            type Part = ($($parts::Part,)+);

            unsafe fn part(&self, block: usize, size: usize) -> Self::Part {
                // SAFETY: the caller asks for each block once.
                unsafe { ($(self.$place.part(block, size),)+) }
            }
        }
    )+};
}

parts_of_tuples! {
    (A 0, B 1)
    (A 0, B 1, C 2)
    (A 0, B 1, C 2, D 3)
    (A 0, B 1, C 2, D 3, E 4)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

    use super::*;

    #[test]
    fn every_block_gets_its_part_of_every_field_once() {
        for (count, size, blocks) in [(0, 32, 0..0), (1, 32, 0..1), (100, 32, 0..4), (1000, 16, 7..41)] {
            let own = Own::of(blocks.clone(), size);
            let all = block_count(count, size);
            let (mut rows, mut sixteens) = (vec![0_usize; count], vec![0; count.div_ceil(LANES)]);
            let (mut ones, mut threes) = (vec![0; all], vec![0_usize; 3 * all]);
            on_threads(3, || {
                let lists = (per_block_mut(&mut ones), several_per_block_mut(&mut threes, 3));
                let fields = (Some([per_row_mut(&mut rows)]), per_sixteen_mut(&mut sixteens), lists);
                own.each(fields, |block, (rows, sixteens, (one, three))| {
                    let [rows] = rows.expect("there is a field");
                    for element in rows.iter_mut().chain(sixteens).chain([one]).chain(three) {
                        *element += block + 1;
                    }
                });
            });

            let expected = |block: usize| if blocks.contains(&block) { block + 1 } else { 0 };
            for (field, width) in [(rows, size), (sixteens, size / LANES), (ones, 1), (threes, 3)] {
                let is_right = |(i, element): (usize, &usize)| *element == expected(i / width);
                assert!(field.iter().enumerate().all(is_right), "{count}, {width}: {field:?}");
            }
        }
    }

    #[test]
    fn a_block_has_what_stands_between_its_start_and_the_next() {
        let (starts, values, mut list) = ([0, 3, 3, 7, 12], [5, 6, 7, 8], [0; 12]);
        let fields = (between_mut(&mut list, &starts), per_block(&values));
        Own::whole(4, 1).each(fields, |_, (part, value)| part.fill(*value));
        assert_eq!(list, [5, 5, 5, 7, 7, 7, 7, 8, 8, 8, 8, 8]);
    }

    #[test]
    #[should_panic(expected = "blocks stand one after another")]
    fn starts_that_descend_are_not_taken() {
        between_mut(&mut [0; 4], &[0, 3, 2]);
    }

    #[test]
    fn pieces_cover_their_range_and_none_is_shorter_than_asked_for() {
        for (count, least_piece) in [(0, 1), (1, 1), (100, 1), (100, 32), (63, 32), (64, 32)] {
            let (covered, shortest) = (AtomicUsize::new(0), AtomicUsize::new(usize::MAX));
            on_threads(8, || {
                run(5..5 + count, least_piece, &|piece: Range<usize>| {
                    covered.fetch_add(piece.len(), Relaxed);
                    shortest.fetch_min(piece.len(), Relaxed);
                });
            });
            assert_eq!(covered.into_inner(), count);
            assert!(shortest.into_inner() >= least_piece.min(count), "{count} by {least_piece}");
        }
    }

    #[test]
    fn the_blocks_of_a_piece_use_one_scratch_memory() {
        let (mut turns, scratch) = (vec![0; 100], || 0);
        on_threads(1, || {
            Own::whole(100, 1).each_with(scratch, per_block_mut(&mut turns), |last, _, turn| {
                *last += 1;
                *turn = *last;
            });
        });
        assert!(turns.contains(&2), "{turns:?}");
    }
}

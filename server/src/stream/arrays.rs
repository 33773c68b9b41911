//! Arrays of frames, in memory that is used again.
//!
//! Enters: arrays of a state. Leaves: bytes that history, watchers and connections share without a copy, in segments
//! that go into one message each: who refers to a message holds no more of its frame.

use std::{
    mem::take,
    sync::{Arc, Mutex, MutexGuard, PoisonError, Weak},
};

use bytes::Bytes;
use nappe_sim::math::Real;
use rayon::prelude::*;

use super::{
    memory::{Counted, FrameMemory},
    pieces::BUDGET_BYTES,
};

/// Arrays of each precision that a session keeps for its next frames.
const SPARE_ARRAYS: usize = 4;

/// Where a session takes the arrays of its frames from, and where they come back to.
#[derive(Debug)]
pub(crate) struct Arrays {
    memory: Arc<FrameMemory>,
    spare: Mutex<Spare>,
}

/// A field over all particles, in segments of a message each; empty without particles.
pub(crate) type Segments = Arc<[Bytes]>;

/// Arrays that nobody refers to.
#[derive(Debug, Default)]
pub(super) struct Spare {
    narrow: SpareOf<f32>,
    wide: SpareOf<f64>,
}

/// Those of one precision.
#[derive(Debug, Default)]
pub(super) struct SpareOf<T> {
    /// Where arrays of several segments are made.
    whole: Vec<T>,
    /// One for each length of segments: two fields may share it.
    shelves: Vec<Shelf<T>>,
}

/// Segments with room for so many numbers.
#[derive(Debug)]
struct Shelf<T> {
    length: usize,
    segments: Vec<Vec<T>>,
    /// How many segments are kept.
    limit: usize,
}

impl<T> SpareOf<T> {
    fn shelf(&mut self, length: usize) -> &mut Shelf<T> {
        let at = self.shelves.iter().position(|shelf| shelf.length == length).unwrap_or_else(|| {
            self.shelves.push(Shelf { length, segments: Vec::new(), limit: 0 });
            self.shelves.len() - 1
        });
        &mut self.shelves[at]
    }
}

impl<T> Shelf<T> {
    fn take(&mut self) -> Vec<T> {
        let mut segment = self.segments.pop().unwrap_or_else(|| Vec::with_capacity(self.length));
        segment.clear();
        segment
    }
}

/// How an array is cut: into segments of equal lengths, but for a shorter last one.
#[derive(Clone, Copy, Debug)]
struct Cuts {
    /// Numbers per segment: those of whole particles.
    length: usize,
    count: usize,
}

impl Cuts {
    fn new<T>(particles: usize, width: usize) -> Self {
        let most = BUDGET_BYTES / (width * size_of::<T>());
        let count = particles.div_ceil(most);
        Self { length: particles.div_ceil(count.max(1)) * width, count }
    }
}

/// A number of an array, whose bytes are little-endian on the wire.
pub(crate) trait Number: Real + bytemuck::Pod {
    /// The number whose bytes here are those of `self` on the wire.
    fn to_wire(self) -> Self;

    /// The spare arrays of such numbers.
    fn spare(spare: &mut Spare) -> &mut SpareOf<Self>;
}

impl Number for f32 {
    fn to_wire(self) -> Self {
        Self::from_bits(self.to_bits().to_le())
    }

    fn spare(spare: &mut Spare) -> &mut SpareOf<Self> {
        &mut spare.narrow
    }
}

impl Number for f64 {
    fn to_wire(self) -> Self {
        Self::from_bits(self.to_bits().to_le())
    }

    fn spare(spare: &mut Spare) -> &mut SpareOf<Self> {
        &mut spare.wide
    }
}

impl Arrays {
    pub(crate) fn new(memory: Arc<FrameMemory>) -> Arc<Self> {
        Arc::new(Self { memory, spare: Mutex::default() })
    }

    pub(super) fn memory(&self) -> &Arc<FrameMemory> {
        &self.memory
    }

    /// An array to be filled with `width` numbers for each of so many particles, with room from an earlier frame if
    /// there is one.
    pub(super) fn take<T: Number>(&self, particles: usize, width: usize) -> Vec<T> {
        let cuts = Cuts::new::<T>(particles, width);
        let mut spare = self.lock();
        let spare = T::spare(&mut spare);
        if cuts.count > 1 { take(&mut spare.whole) } else { spare.shelf(cuts.length).take() }
    }

    /// Shares an array of numbers as they are on the wire, `width` for each particle; by all threads of the caller's
    /// pool.
    pub(super) fn share<T: Number>(self: &Arc<Self>, numbers: Vec<T>, width: usize) -> Segments {
        let cuts = Cuts::new::<T>(numbers.len() / width, width);
        let room: Vec<Vec<T>> = {
            let mut spare = self.lock();
            let shelf = T::spare(&mut spare).shelf(cuts.length);
            shelf.limit = SPARE_ARRAYS * cuts.count;
            let copied = if cuts.count > 1 { cuts.count } else { 0 };
            (0..copied).map(|_| shelf.take()).collect()
        };
        match cuts.count {
            0 => return Arc::default(),
            1 => return [self.share_segment(numbers, cuts)].into(),
            _ => {}
        }

        let parts = room.into_par_iter().zip(numbers.par_chunks(cuts.length));
        let copied = parts.map(|(mut segment, numbers)| {
            segment.extend_from_slice(numbers);
            segment
        });
        let copied: Vec<Vec<T>> = copied.collect();
        T::spare(&mut self.lock()).whole = numbers;
        copied.into_iter().map(|segment| self.share_segment(segment, cuts)).collect()
    }

    fn share_segment<T: Number>(self: &Arc<Self>, numbers: Vec<T>, cuts: Cuts) -> Bytes {
        let counted = Counted::new(&self.memory, size_of_val(numbers.as_slice()));
        Bytes::from_owner(Shared { numbers, cuts, home: Arc::downgrade(self), _counted: counted })
    }

    fn lock(&self) -> MutexGuard<'_, Spare> {
        // No code that holds the lock can leave it half changed.
        self.spare.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// An array that is shared, until the last who refers to it is gone.
struct Shared<T: Number> {
    numbers: Vec<T>,
    cuts: Cuts,
    home: Weak<Arrays>,
    _counted: Counted,
}

impl<T: Number> AsRef<[u8]> for Shared<T> {
    fn as_ref(&self) -> &[u8] {
        bytemuck::cast_slice(&self.numbers)
    }
}

impl<T: Number> Drop for Shared<T> {
    fn drop(&mut self) {
        if let Some(home) = self.home.upgrade() {
            let mut spare = home.lock();
            let shelf = T::spare(&mut spare).shelf(self.cuts.length);
            if shelf.segments.len() < shelf.limit {
                shelf.segments.push(take(&mut self.numbers));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_counted_while_anybody_refers_to_them_and_come_back_once() {
        let memory = Arc::new(FrameMemory::default());
        let arrays = Arrays::new(Arc::clone(&memory));
        let mut numbers = arrays.take::<f32>(1000, 1);
        numbers.resize(1000, 1.0_f32.to_wire());
        let place = numbers.as_ptr();

        let segments = arrays.share(numbers, 1);
        let mut whole = segments[0].clone();
        assert_eq!(segments.len(), 1);
        drop(segments);
        assert_eq!(whole[..4], [0, 0, 0x80, 0x3f]);
        memory.keep(4000);
        assert_eq!(memory.held(), 0, "the session keeps it");
        let piece = whole.split_to(12);
        drop(whole);
        memory.let_go(4000);
        assert_eq!(memory.held(), 4000, "a piece holds all of it");
        drop(piece);
        assert_eq!(memory.held(), 0);
        let (again, fresh) = (arrays.take::<f32>(1000, 1), arrays.take::<f32>(1000, 1));
        assert_eq!(again.as_ptr(), place, "the next frame uses it again");
        assert_ne!(fresh.as_ptr(), place);
    }

    #[test]
    fn who_refers_to_a_segment_holds_no_other_one() {
        let memory = Arc::new(FrameMemory::default());
        let arrays = Arrays::new(Arc::clone(&memory));
        for particles in [0, 1, 100_000, 300_000] {
            let mut numbers = arrays.take::<f64>(particles, 3);
            numbers.clear();
            numbers.extend((0..3 * particles).map(|i| i as f64));
            let expected: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
            let segments = arrays.share(numbers, 3);
            assert_eq!(segments.concat(), expected);
            assert!(segments.iter().all(|segment| segment.len() <= BUDGET_BYTES && segment.len() % 24 == 0));
            assert_eq!(memory.held(), expected.len() as u64);
            let last = segments.last().cloned();
            drop(segments);
            assert_eq!(memory.held(), last.map_or(0, |last| last.len() as u64));
        }
        assert_eq!(memory.held(), 0);
    }
}

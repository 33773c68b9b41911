//! Memory of frames: counted for the whole server as long as anybody refers to it, and used again afterwards.
//!
//! Enters: arrays of a state. Leaves: bytes that history, watchers and connections share without a copy. What
//! exceeds the frames that sessions keep is held by watchers.

use std::{
    mem::take,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError, Weak,
        atomic::{AtomicU64, Ordering},
    },
};

use bytes::Bytes;

/// Arrays of each precision that a session keeps for its next frames.
const SPARE_ARRAYS: usize = 4;

/// Bytes of all frames of a server.
#[derive(Debug, Default)]
pub(crate) struct FrameMemory {
    /// Arrays that somebody refers to.
    live: AtomicU64,
    /// Those among them that sessions keep.
    kept: AtomicU64,
}

impl FrameMemory {
    /// A session keeps so many more bytes.
    pub(super) fn keep(&self, bytes: u64) {
        self.kept.fetch_add(bytes, Ordering::Relaxed);
    }

    /// A session keeps so many bytes no longer.
    pub(super) fn let_go(&self, bytes: u64) {
        self.kept.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Bytes that are referred to by watchers alone.
    pub(crate) fn held(&self) -> u64 {
        self.live.load(Ordering::Relaxed).saturating_sub(self.kept.load(Ordering::Relaxed))
    }
}

/// Where a session takes the arrays of its frames from, and where they come back to.
#[derive(Debug)]
pub(crate) struct Arrays {
    memory: Arc<FrameMemory>,
    spare: Mutex<Spare>,
}

/// Arrays that nobody refers to.
#[derive(Debug, Default)]
pub(super) struct Spare {
    narrow: Vec<Vec<f32>>,
    wide: Vec<Vec<f64>>,
}

/// A number of an array, whose bytes are little-endian on the wire.
pub(crate) trait Number: bytemuck::Pod + Send + Sync + Default {
    fn to_f64(self) -> f64;

    /// The number whose bytes here are those of `self` on the wire.
    fn to_wire(self) -> Self;

    /// The spare arrays of such numbers.
    fn spare(spare: &mut Spare) -> &mut Vec<Vec<Self>>;
}

impl Number for f32 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    fn to_wire(self) -> Self {
        Self::from_bits(self.to_bits().to_le())
    }

    fn spare(spare: &mut Spare) -> &mut Vec<Vec<Self>> {
        &mut spare.narrow
    }
}

impl Number for f64 {
    fn to_f64(self) -> f64 {
        self
    }

    fn to_wire(self) -> Self {
        Self::from_bits(self.to_bits().to_le())
    }

    fn spare(spare: &mut Spare) -> &mut Vec<Vec<Self>> {
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

    /// An array to be filled, with room from an earlier frame if there is one.
    pub(super) fn take<T: Number>(&self) -> Vec<T> {
        T::spare(&mut self.lock()).pop().unwrap_or_default()
    }

    /// Shares an array of numbers as they are on the wire.
    pub(super) fn share<T: Number>(self: &Arc<Self>, numbers: Vec<T>) -> Bytes {
        let counted = Counted::new(&self.memory, size_of_val(numbers.as_slice()));
        Bytes::from_owner(Shared { numbers, home: Arc::downgrade(self), _counted: counted })
    }

    fn lock(&self) -> MutexGuard<'_, Spare> {
        // No code that holds the lock can leave it half changed.
        self.spare.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Bytes that count until this is dropped.
#[derive(Debug)]
pub(super) struct Counted {
    memory: Arc<FrameMemory>,
    bytes: u64,
}

impl Counted {
    pub(super) fn new(memory: &Arc<FrameMemory>, bytes: usize) -> Self {
        memory.live.fetch_add(bytes as u64, Ordering::Relaxed);
        Self { memory: Arc::clone(memory), bytes: bytes as u64 }
    }

    /// Shares bytes that count until the last who refers to them is gone.
    pub(super) fn share(memory: &Arc<FrameMemory>, bytes: Vec<u8>) -> Bytes {
        struct Owner(Vec<u8>, #[expect(dead_code, reason = "counts until it is dropped")] Counted);

        impl AsRef<[u8]> for Owner {
            fn as_ref(&self) -> &[u8] {
                &self.0
            }
        }

        let counted = Self::new(memory, bytes.len());
        Bytes::from_owner(Owner(bytes, counted))
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.memory.live.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// An array that is shared, until the last who refers to it is gone.
struct Shared<T: Number> {
    numbers: Vec<T>,
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
            let spare = T::spare(&mut spare);
            if spare.len() < SPARE_ARRAYS {
                spare.push(take(&mut self.numbers));
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
        let mut numbers = arrays.take::<f32>();
        numbers.resize(1000, 1.0_f32.to_wire());
        let place = numbers.as_ptr();

        let mut whole = arrays.share(numbers);
        assert_eq!(whole[..4], [0, 0, 0x80, 0x3f]);
        memory.keep(4000);
        assert_eq!(memory.held(), 0, "the session keeps it");
        let piece = whole.split_to(12);
        drop(whole);
        memory.let_go(4000);
        assert_eq!(memory.held(), 4000, "a piece holds all of it");
        drop(piece);
        assert_eq!(memory.held(), 0);
        let (again, fresh) = (arrays.take::<f32>(), arrays.take::<f32>());
        assert_eq!((again.as_ptr(), fresh.capacity()), (place, 0), "the next frame uses it again");
    }
}

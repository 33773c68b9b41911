//! Memory of frames that show more than positions: it counts once somebody asks for that.
//!
//! Enters: what frames are to hold. Leaves: whether the server has room for them. Positions, and the frames that a session
//! keeps within its budget, count from its start.

use std::sync::{Mutex, PoisonError};

use crate::{error::ServiceError, memory::Claim, stream::FieldSet};

/// Bytes per particle of the largest array, which is made whole before it is cut into segments.
const WHOLE: u64 = 24;

/// What counts for the frames of a session beyond what counts from its start.
#[derive(Debug)]
pub(super) struct FrameRoom {
    /// The memory, and how many bytes of it are taken.
    taken: Mutex<(Claim, u64)>,
    particles: u64,
    /// Bytes of the frames that it keeps.
    budget: u64,
}

impl FrameRoom {
    /// For a session of so many particles that keeps so many bytes of frames; its memory is taken from a claim of no bytes.
    pub(super) fn new(memory: Claim, particles: u64, budget: u64) -> Self {
        Self { taken: Mutex::new((memory, 0)), particles, budget }
    }

    /// Makes room for frames with these fields. It stays until the session is deleted, since the next frames are made in the
    /// arrays of these.
    ///
    /// # Errors
    /// If the server has not as much memory left.
    pub(super) fn make(&self, fields: FieldSet) -> Result<(), ServiceError> {
        let needed = self.needed(fields);
        // No code that holds the lock can leave it half changed.
        let mut taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        let (memory, bytes) = &mut *taken;
        if needed > *bytes {
            memory.grow(needed - *bytes)?;
            *bytes = needed;
        }
        Ok(())
    }

    /// A frame is made while others are kept: as many as the budget has room for, and always the newest.
    fn needed(&self, fields: FieldSet) -> u64 {
        let frame = fields.without(FieldSet::ALWAYS).stride() as u64 * self.particles;
        if frame == 0 {
            return 0;
        }
        WHOLE * self.particles + frame.max((2 * frame).saturating_sub(self.budget))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{error::Reason, memory::MemoryAccount};

    #[test]
    fn frames_with_more_than_positions_count_once_and_are_refused_without_room() {
        let account = MemoryAccount::of_server(1000);
        let (more, all) = (FieldSet::ALWAYS.union(FieldSet::of_part(1)), FieldSet::OF_STATE);
        let width = |fields: FieldSet| fields.without(FieldSet::ALWAYS).stride() as u64;
        let room = |budget| FrameRoom::new(account.claim(), 2, budget);

        let large = room(1 << 20);
        large.make(FieldSet::ALWAYS).expect("positions count from the start");
        assert_eq!(account.used(), 0);
        for _ in 0..2 {
            large.make(more).expect("room");
            assert_eq!(account.used(), 2 * (WHOLE + width(more)), "the frame that is made");
        }
        large.make(all).expect("room");
        assert_eq!(account.used(), 2 * (WHOLE + width(all)));

        let small = room(0);
        small.make(more).expect("room");
        assert_eq!(
            account.used(),
            2 * (WHOLE + width(all)) + 2 * (WHOLE + 2 * width(more)),
            "the newest, too"
        );
        drop(large);
        let other = account.claim();
        other.grow(1000 - account.used()).expect("all that is left");
        assert_eq!(small.make(all).expect_err("full").reason, Reason::ServerMemoryFull);
        drop((small, other));
        assert_eq!(account.used(), 0);
    }
}

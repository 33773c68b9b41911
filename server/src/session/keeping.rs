//! Takes states of a session that is kept, between two of its steps: the thread that steps copies, another one writes.

use std::time::{Duration, Instant};

use super::{pending_changes::Queue, simulator::Behind, stepper::Stepper, taken::Taken};
use crate::{error::ServiceError, memory::Claim, state::StatePlace};

/// Bytes of a particle in a state and in its frame, at most: of cloth in f64 with all that an integrator and calls add.
const PARTICLE_BYTES: u64 = 320;

/// What was taken, what its memory is claimed by, and how long it took.
type Timed = (Taken, Claim, Duration);

impl Stepper {
    /// Takes a state, which is to be kept at a place.
    pub(super) fn keep(&mut self, place: StatePlace, pending: Queue) {
        let begin = Instant::now();
        if !self.catch_up() || self.simulator.is_torn {
            return self.control.end_states();
        }
        match self.take(pending, begin) {
            Ok((taken, memory, cost)) => self.control.write_state(place, taken, memory, cost),
            Err(full) => self.control.state_written(Err(full.to_string())),
        }
    }

    /// Keeps the session as it stands, at its end, and waits until that is written; or removes what is kept of it.
    pub(super) fn end_keeping(&mut self) {
        let Some((mut keep, due)) = self.control.end_keeping() else { return };
        let begin = Instant::now();
        if let Some((place, pending)) = due
            && self.simulator.fetch(Behind::Nothing).is_ok()
            && !self.simulator.is_torn
        {
            match self.take(pending, begin) {
                Ok((taken, memory, cost)) => keep.write(place, taken, memory, cost),
                Err(full) => keep.not_kept(&full.to_string()),
            }
        }
        keep.end();
    }

    /// What is to be kept of the state as it is, with the changes that wait.
    fn take(&self, pending: Queue, begin: Instant) -> Result<Timed, ServiceError> {
        let memory = self.simulator.memory.another();
        let of_particles = self.simulator.status.properties.particle_count.saturating_mul(PARTICLE_BYTES);
        // Ways of pins and the grid of snow are not larger than what is counted for them.
        memory.grow(of_particles.saturating_add(self.simulator.snow_bytes + self.simulator.changed_bytes))?;
        let taken = self.simulator.taken(pending);
        Ok((taken, memory, begin.elapsed()))
    }
}

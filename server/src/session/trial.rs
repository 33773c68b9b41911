//! Whether changes can be made that put surfaces of cloth somewhere: tried before they are accepted, between two steps.
//!
//! Enters: changes of a call. Leaves: why they cannot be made. At a later step the others will be elsewhere: such changes are accepted,
//! and looked at when they are made.

use nappe_sim::{interrupt::Interrupt, world::Change};
use tokio::sync::oneshot;

use super::{control::Control, desk::Trial, transition::State};
use crate::error::ServiceError;

/// A call that waits to be told whether changes can be made: if it goes, they are not tried any longer.
struct Waiting {
    tried: oneshot::Receiver<Result<(), ServiceError>>,
    interrupt: Interrupt,
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.interrupt.request();
    }
}

impl Control {
    /// Refuses changes before step `at_step` that could not be made, as far as that is known now.
    pub(super) async fn try_out(&self, at_step: u64, changes: &[Change]) -> Result<(), ServiceError> {
        match self.begin_trial(at_step, changes)? {
            // If nobody tells it, the session has come to its end, and refuses the call itself.
            Some(mut waiting) => (&mut waiting.tried).await.unwrap_or(Ok(())),
            None => Ok(()),
        }
    }

    /// Asks the thread, if there is something to be tried and that step is the next one: after the states that wait for it.
    fn begin_trial(&self, at_step: u64, changes: &[Change]) -> Result<Option<Waiting>, ServiceError> {
        if !self.rules.puts_surfaces(changes) {
            return Ok(None);
        }
        let mut desk = self.open()?;
        let goes_on = desk.state == State::Paused || desk.state.is_stepping();
        if !goes_on || at_step > desk.next_step {
            return Ok(None);
        }

        let (done, tried) = oneshot::channel();
        self.check_room(&mut desk, Some(&done))?;
        // Of a body that several calls put, the last state counts.
        let mut list = changes.to_vec();
        let due: Vec<&Change> = desk.pending.queue().states_due(desk.next_step).collect();
        for waiting in due.into_iter().rev() {
            if !list.iter().any(|later| is_of_same_body(later, waiting)) {
                list.insert(0, waiting.clone());
            }
        }
        let interrupt = self.interrupt.of_part();
        desk.trials.push(Trial { changes: list, interrupt: interrupt.clone(), done });
        self.changed.notify_one();
        Ok(Some(Waiting { tried, interrupt }))
    }
}

/// Whether both changes put one body.
fn is_of_same_body(one: &Change, other: &Change) -> bool {
    match (one, other) {
        (Change::State { body: one, .. }, Change::State { body: other, .. }) => one == other,
        _ => false,
    }
}

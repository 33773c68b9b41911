//! Calls that change a session: parameters, now or before a later step, and what becomes of those that wait.
//!
//! Enters: changes, which are checked here. Leaves: where they stand among all that the session applies.

use nappe_sim::{
    collide::Pose,
    world::{Change, Departure},
};
use tokio::sync::oneshot;

use super::{
    control::Control,
    desk::{Desk, Ending},
    pending_changes::{Accepted, PendingChange},
    transition::Event,
    waiting::{Answer, For},
};
use crate::{error::ServiceError, state::Record};

/// Steps that a change may lie ahead.
const MAX_STEPS_AHEAD: u64 = 10_000_000;

impl Control {
    /// Takes changes for step `at_step`, or for the first that has not begun; the answer comes when they take effect.
    pub(super) fn update(
        &self,
        at_step: u64,
        changes: Vec<Change>,
        answer: Option<Answer>,
    ) -> Result<Accepted, ServiceError> {
        self.rules.check(&changes).map_err(|error| ServiceError::from(&error))?;

        let mut desk = self.open()?;
        self.check_room(&mut desk, answer.as_ref())?;
        self.change(&mut desk, Event::Update)?;
        let latest = desk.next_step.saturating_add(MAX_STEPS_AHEAD);
        if at_step > latest {
            let problem = format!("is {at_step}: allowed is at most {latest}, {MAX_STEPS_AHEAD} steps ahead");
            return Err(ServiceError::field("at_step", problem)
                .with("value", at_step)
                .with("allowed", latest));
        }

        let step = at_step.max(desk.open_step());
        self.check_speeds(&desk, step, &changes)?;
        let accepted = desk.push(step, changes)?;
        if let Some(answer) = answer {
            desk.waiting.push(For::Begin(step), answer);
        }
        Ok(accepted)
    }

    /// Refuses moves of colliders, for step `step`, whose surfaces would be too fast where particles are in the newest frame.
    pub(super) fn check_speeds(
        &self,
        desk: &Desk,
        step: u64,
        changes: &[Change],
    ) -> Result<(), ServiceError> {
        if !changes.iter().any(|change| matches!(change, Change::Collider(_))) {
            return Ok(());
        }
        let (told, newest) = (self.status.progress().parameters.collider_poses, self.status.feed.newest());
        let waiting = desk.pending.queue().moved();
        let departure = |name: &str| {
            let pose = told.iter().find(|pose| pose.name == name)?;
            let pose = Pose { position: pose.position?.into(), turn: pose.turn?.into() };
            let is_here = step == desk.next_step && !waiting.contains(name);
            Some(if is_here { Departure::Now(pose) } else { Departure::Later(pose) })
        };
        let refused = self.rules.check_speeds(changes, departure, || newest.frame.bounds());
        refused.map_err(|error| ServiceError::from(&error))
    }

    /// Up to `count` of the changes that wait, after the one given, in the order in which they take effect; and the
    /// last of them if more follow.
    pub(super) fn pending_changes(
        &self,
        after: Option<Accepted>,
        count: usize,
    ) -> (Vec<PendingChange>, Option<Accepted>) {
        let desk = self.lock();
        desk.pending.queue().page(after.max(desk.last_made()), count)
    }

    /// How many changes wait.
    pub(super) fn pending_count(&self) -> usize {
        self.lock().pending.queue().count()
    }

    /// Drops changes that wait: those of these orders, or all. Returns how many there were.
    pub(super) fn drop_changes(&self, orders: Option<&[u64]>) -> u64 {
        let mut desk = self.lock();
        if desk.ending == Ending::Thread {
            // What is kept of it has them still.
            return 0;
        }
        let made = desk.last_made();
        let dropped = desk.pending.drop_groups(made, orders);
        let count = dropped.len() as u64;
        if count > 0 {
            desk.note(&Record::Dropped(dropped));
        }
        count
    }

    /// Asks for the session to be put back to its start, between two steps.
    pub(super) fn reset(&self) -> Result<oneshot::Receiver<Accepted>, ServiceError> {
        self.rules.check(&[Change::Reset]).map_err(|error| ServiceError::from(&error))?;
        let mut desk = self.open()?;
        let (done, reset) = oneshot::channel();
        self.check_room(&mut desk, Some(&done))?;
        self.change(&mut desk, Event::Update)?;
        desk.resets.push(done);
        self.changed.notify_one();
        Ok(reset)
    }
}

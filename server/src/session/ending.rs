//! What follows a step: frames, and the two ways a session ends, finished or failed.

use std::any::Any;

use nappe_proto::v1;

use super::{
    start::head,
    stepper::Stepper,
    transition::{Effect, Event, State},
};
use crate::{
    error::{Reason, ServiceError},
    stream::{Contents, EncodedFrame, Ending, FrameHead, NotFinite},
};

impl Stepper {
    /// Publishes the state as frame `frame`; a number that cannot leave fails the session.
    pub(super) fn publish(&mut self, frame: u64) -> bool {
        match self.encode(frame) {
            Ok(encoded) => {
                self.status.feed.publish(encoded);
                true
            }
            Err(fault) => {
                let step = self.simulation.step_count();
                let error = ServiceError::new(Reason::NotFinite, fault.to_string());
                self.fail(error, step.saturating_sub(1), fault.particle(), Some(fault.value));
                false
            }
        }
    }

    fn encode(&self, frame: u64) -> Result<EncodedFrame, NotFinite> {
        let mut head = head(&self.simulation, frame, self.status.progress().diagnostics);
        let hashed = frame.is_multiple_of(self.status.facts.hash_interval.into()) || self.is_last();
        head.state_hash = hashed.then(|| self.hash());
        self.encode_contents(self.status.feed.demand(), head)
    }

    fn encode_contents(&self, wanted: Contents, head: FrameHead) -> Result<EncodedFrame, NotFinite> {
        let simulation = &self.simulation;
        self.pool.install(|| EncodedFrame::encode(simulation, wanted, head))
    }

    fn is_last(&self) -> bool {
        let (step, limit) = (self.simulation.step_count(), self.status.facts.step_limit);
        self.state == State::Finished || self.state == State::Failed || (limit > 0 && step >= limit)
    }

    /// Encodes the newest frame again with all that is in demand, if its state still stands.
    pub(super) fn provide(&mut self) {
        let newest = self.status.feed.newest().frame;
        let stands = newest.head.step == self.simulation.step_count()
            && self.is_intact(self.status.progress().failure.as_ref());
        if stands && !newest.contents().covers(self.status.feed.demand()) {
            let wanted = newest.contents().union(self.status.feed.demand());
            // What cannot be encoded fails at the next frame, if the session has one.
            if let Ok(encoded) = self.encode_contents(wanted, newest.head.clone()) {
                self.status.feed.publish(encoded);
            }
        }
    }

    /// Whether the state is that of the steps taken. After a panic it may be half changed, and snow
    /// whose step failed may stand in the middle of it: such a state is not looked at again.
    fn is_intact(&self, failure: Option<&v1::Failure>) -> bool {
        let has_snow = self.status.facts.snow_cell.is_some();
        failure.is_none_or(|failure| failure.reason != Reason::SessionPanicked.name() && !has_snow)
    }

    /// The last frame, the end of the streams, the answers.
    pub(super) fn finish(&mut self, effect: Effect) {
        if !self.publish_last() {
            return;
        }
        self.note_state();
        let head = &self.status.feed.newest().frame.head;
        self.status.feed.end(Ending::Finished(v1::SessionEnd {
            frame: head.frame,
            step: head.step,
            state_hash: self.hash(),
        }));
        let answer =
            if effect == Effect::Finish { Ok(self.status.describe()) } else { Err(self.interrupted()) };
        self.answer_waiting(&answer);
    }

    /// Publishes the state as the last frame: anew, or with its hash.
    fn publish_last(&mut self) -> bool {
        let newest = self.status.feed.newest().frame;
        if newest.head.step != self.simulation.step_count() {
            return self.publish(newest.head.frame + 1);
        }
        true
    }

    pub(super) fn fail(&mut self, error: ServiceError, step: u64, particle: Option<u64>, value: Option<f64>) {
        self.change(Event::Broke).expect("a session that stepped may fail");
        let time_seconds = self.simulation.time();
        tracing::warn!(session = self.status.facts.id, step, "{error}");
        let failure = v1::Failure {
            reason: error.reason.name().to_owned(),
            message: error.message.clone(),
            step,
            time_seconds,
            particle,
            value,
        };
        let mut told = error.with("session_id", &self.status.facts.id).with("step", step);
        told = told.with("time_seconds", time_seconds);
        told = particle.into_iter().fold(told, |told, particle| told.with("particle", particle));
        told = value.into_iter().fold(told, |told, value| told.with("value", value));
        self.note_failure(failure, &told);
    }

    fn note_failure(&mut self, failure: v1::Failure, told: &ServiceError) {
        let newest = self.status.feed.newest().frame;
        let is_newest = newest.head.step == self.simulation.step_count();
        let is_intact = self.is_intact(Some(&failure));
        let state_hash = match is_intact {
            true => Some(self.hash()),
            false if is_newest => newest.head.state_hash,
            false => None,
        };
        self.status.update(|progress| {
            progress.state = State::Failed;
            progress.state_hash = state_hash;
            progress.failure = Some(failure);
        });
        // The last good state leaves as a frame, if it can be encoded.
        if is_intact
            && !is_newest
            && let Ok(encoded) = self.encode(newest.head.frame + 1)
        {
            self.status.feed.publish(encoded);
        }
        self.status.feed.end(Ending::Broken(told.clone()));
        self.answer_waiting(&Err(told.clone()));
    }

    /// A panic in a step.
    pub(super) fn panicked(&mut self, payload: &(dyn Any + Send)) {
        let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
        let text = text.unwrap_or_else(|| "without a message".to_owned());
        self.panic_next = false;
        let progress = self.status.progress();
        self.state = State::Failed;
        let message = format!("session '{}' panicked: {text}", self.status.facts.id);
        tracing::error!(session = self.status.facts.id, step = progress.step, "{message}");
        let failure = v1::Failure {
            reason: Reason::SessionPanicked.name().to_owned(),
            message: message.clone(),
            step: progress.step,
            time_seconds: progress.time,
            particle: None,
            value: None,
        };
        let told = ServiceError::new(Reason::SessionPanicked, message)
            .with("session_id", &self.status.facts.id)
            .with("step", progress.step);
        self.note_failure(failure, &told);
    }
}

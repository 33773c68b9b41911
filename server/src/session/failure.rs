//! Why a session failed, or refuses a command.
//!
//! Enters: an error and where it arose. Leaves: the failure in the session's description, and the
//! error that calls and streams end with.

use std::any::Any;

use nappe_proto::v1;

use super::status::Progress;
use crate::error::{Reason, ServiceError, panic_message};

/// Where a simulation failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FailurePoint {
    /// Index of the step that failed, from 0.
    pub step: u64,
    /// Simulated time before that step.
    pub time_seconds: f64,
    /// The first particle concerned, over all particles, if one is known.
    pub particle: Option<u64>,
    /// The value that is not allowed, if there is one.
    pub value: Option<f64>,
}

/// Why a session failed, in both forms.
#[derive(Clone, Debug)]
pub(super) struct SessionFailure {
    /// In the session's description.
    pub failure: v1::Failure,
    /// What calls and streams end with.
    pub error: ServiceError,
}

impl SessionFailure {
    /// A simulation that cannot go on.
    pub(super) fn new(id: &str, error: ServiceError, point: FailurePoint) -> Self {
        let FailurePoint { step, time_seconds, particle, value } = point;
        let failure = v1::Failure {
            reason: error.reason.name().to_owned(),
            message: error.message.clone(),
            step,
            time_seconds,
            particle,
            value,
        };

        let mut error = error.with("session_id", id).with("step", step).with("time_seconds", time_seconds);
        if let Some(particle) = particle {
            error = error.with("particle", particle);
        }
        if let Some(value) = value {
            error = error.with("value", value);
        }
        Self { failure, error }
    }

    /// A panic in a step; `progress` is that of the steps before it.
    pub(super) fn panicked(id: &str, payload: &(dyn Any + Send), progress: &Progress) -> Self {
        let message = format!("session '{id}' panicked: {}", panic_message(payload));
        let failure = v1::Failure {
            reason: Reason::SessionPanicked.name().to_owned(),
            message: message.clone(),
            step: progress.step,
            time_seconds: progress.time_seconds,
            particle: None,
            value: None,
        };
        let error = ServiceError::new(Reason::SessionPanicked, message)
            .with("session_id", id)
            .with("step", progress.step);
        Self { failure, error }
    }
}

/// A command that the session's state does not allow; `failure` is why the session failed, if it did.
pub(super) fn refused(id: &str, reason: Reason, failure: Option<v1::Failure>) -> ServiceError {
    let message = match reason {
        Reason::SessionPlaying => format!("session '{id}' is playing: pause it to take single steps"),
        Reason::SessionFinished => format!("session '{id}' is finished"),
        _ => format!("session '{id}' failed earlier"),
    };
    let error = ServiceError::new(reason, message).with("session_id", id);
    match failure {
        Some(failure) => error.with("failure", &failure.reason).with("failure_message", failure.message),
        None => error,
    }
}

/// Steps that a call waits for, and that another command cut short at step `step`.
pub(super) fn interrupted(id: &str, step: u64) -> ServiceError {
    let message = format!("session '{id}' was interrupted at step {step}, before the steps were taken");
    ServiceError::new(Reason::StepsInterrupted, message).with("session_id", id).with("step", step)
}

//! How far a setting runs as a scene that is written with it: to the end of the scene, until a step fails, or as far as was looked at.

use super::verify::Verified;
use crate::{
    case::{Case, Times},
    chart::Row,
    method::Stepped,
    run::{End, Phase, run_as_written},
};

/// How far a setting runs as a scene that is written with it, within what the scene allows of its state.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// Steps of the scene.
    pub steps: u64,
    /// The time (s) at their end.
    pub until: f64,
    /// Why it is no further.
    pub end: ReachEnd,
}

/// What ends how far a setting runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReachEnd {
    /// The end of the scene.
    Scene,
    /// The next step fails, for this cause.
    Failed(String),
    /// There was no time to look beyond the window.
    Time,
}

/// A row that is right enough and verified, and how far it runs.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) row: Row,
    pub(super) verified: Verified,
    pub(super) reach: Reach,
}

/// Runs a setting over so many steps of the scene; `steps` are those of the window, and of the scene.
pub(super) fn reach(case: &Case, stepped: Stepped, [window, scene]: [u64; 2], phase: &Phase) -> Reach {
    let times = Times { interval: case.dt(), marks: vec![scene] };
    let made = run_as_written(case, stepped, &times, phase);
    let (steps, end) = match made.end {
        End::Reached => (scene, ReachEnd::Scene),
        End::Failed(failure) => (made.seconds.len() as u64, ReachEnd::Failed(failure.cause)),
        End::Stopped | End::Costly => (window, ReachEnd::Time),
    };
    Reach { steps, until: times.time(steps), end }
}

impl Found {
    /// That of two which runs further; the first where both run as far.
    pub(super) fn further(first: Option<Self>, second: Self) -> Self {
        match first {
            Some(first) if first.reach.steps >= second.reach.steps => first,
            _ => second,
        }
    }
}

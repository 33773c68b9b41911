//! The cheapest setting that is verified and runs as a scene that is written with it: to the end of the scene, until a step fails, or
//! as far as was looked at.

use super::verify::Verified;
use crate::{
    case::{Case, Times},
    chart::Row,
    method::Stepped,
    run::{Budget, End, Phase, run_as_written},
};

/// How far a setting runs as a scene that is written with it, within what the scene allows of its state.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// Steps of the scene.
    pub steps: u64,
    /// The time (s) at their end.
    pub until: f64,
    /// Why it is no further: the scene ends, the next step fails, or there was no time to look beyond the window.
    pub end: End,
}

/// A row that is accurate enough and verified, and how far it runs.
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
    let steps = match made.end {
        End::Reached => scene,
        End::Failed(_) => made.seconds.len() as u64,
        End::Cut(_) | End::Costly => window,
    };
    Reach { steps, until: times.time(steps), end: made.end }
}

/// What the search for the cheapest came to.
pub(super) struct Sought {
    /// What was found, verified and run on.
    pub(super) found: Option<Found>,
    /// The cheapest that there was no time to verify.
    pub(super) unverified: Option<(Row, Verified)>,
    /// Steps of the window, and of the scene.
    pub(super) steps: [u64; 2],
}

impl Sought {
    /// What was found, where it runs to the end of the window within what the scene allows of its state.
    pub(super) fn met(&self) -> Option<&Found> {
        self.found.as_ref().filter(|found| found.reach.steps >= self.steps[0])
    }

    /// Of some places of rows, the cheapest first, that whose errors as verified, with its own step and with half of it, are at most
    /// those that are allowed (m), and which comes to the end of the scene; where none does, the one that comes furthest. Beside it
    /// the cheapest that there was no time to verify. Shares of the budget end both parts.
    pub(super) fn of(
        (case, steps): (&Case, [u64; 2]),
        places: &[usize],
        allowed: [f64; 2],
        verify: &mut dyn FnMut(usize, &Phase) -> (Row, Verified),
        (budget, shares): (&Budget, [f64; 2]),
        tell: &dyn Fn(&str),
    ) -> Self {
        let [verifying, reaching] = shares.map(|share| budget.until(share));
        let mut sought = Self { found: None, unverified: None, steps };
        for place in places {
            tell("verifying the cheapest with half its step");
            let (row, verified) = verify(*place, &verifying);
            // An error that was small by chance may be large with half the step.
            if verified.error > allowed[0] {
                continue;
            }
            if verified.is_cut {
                sought.unverified = Some((row, verified));
                break;
            }
            if verified.half_step_error.is_none_or(|error| error > allowed[1]) {
                continue;
            }
            tell("running the cheapest to the end of the scene");
            let reach = reach(case, row.stepped, steps, &reaching);
            let is_last = reach.end.failure().is_none();
            // The first where both run as far.
            if sought.found.as_ref().is_none_or(|first| first.reach.steps < reach.steps) {
                sought.found = Some(Found { row, verified, reach });
            }
            if is_last {
                break;
            }
        }
        sought
    }
}

//! What theory says of a case at rest.

use nappe_sim::cloth::{Integrator, Network};

use super::{spectrum::largest_frequency, theory::critical_step_of_all};
use crate::case::Case;

/// What theory says of the springs of a case at rest: of each body the fastest mode and the damping over stiffness that its
/// springs have.
#[derive(Clone, Debug, PartialEq)]
pub struct Theory {
    /// Frequency (rad/s) and damping over stiffness (s) of each body.
    bodies: Vec<[f64; 2]>,
}

impl Theory {
    /// None where springs of a body differ in damping over stiffness, where elements bend, or the medium drags.
    pub(super) fn of(case: &Case) -> Option<Self> {
        let of_body =
            |network: &Network| damping_time(network).map(|time| [largest_frequency(network), time]);
        let bodies: Option<Vec<_>> = case.setup.bodies.iter().map(|body| of_body(&body.network)).collect();
        bodies.map(|bodies| Self { bodies: bodies.into_iter().filter(|[w, _]| *w > 0.0).collect() })
    }

    /// The longest stable step (s) of an explicit method; 0 where every step grows.
    pub fn limit(&self, integrator: Integrator) -> Option<f64> {
        self.limit_with(integrator, 1.0)
    }

    /// The same with all damping multiplied by a factor.
    pub fn limit_with(&self, integrator: Integrator, factor: f64) -> Option<f64> {
        let limits = self.bodies.iter().map(|[w, time]| critical_step_of_all(integrator, *w, factor * time));
        limits.collect::<Option<Vec<_>>>()?.into_iter().reduce(f64::min)
    }

    /// The frequency (rad/s) of the fastest mode.
    pub fn frequency(&self) -> f64 {
        self.bodies.iter().map(|[w, _]| *w).fold(0.0, f64::max)
    }
}

/// Whether the springs of each body have one damping over stiffness, no element bends, and the medium does not drag.
pub(super) fn has_one_damping(case: &Case) -> bool {
    case.setup.bodies.iter().all(|body| damping_time(&body.network).is_some())
}

/// The damping over stiffness (s) that all springs have, where nothing else acts.
fn damping_time(network: &Network) -> Option<f64> {
    if !network.elements.is_empty() || network.drag != 0.0 {
        return None;
    }
    let mut laws = network.springs.iter().map(|spring| spring.law);
    let first = laws.next()?;
    let time = if first.stiffness > 0.0 { first.damping / first.stiffness } else { return None };
    let is_one = |damping: f64, stiffness: f64| (damping - time * stiffness).abs() <= 1e-9 * time * stiffness;
    laws.all(|law| is_one(law.damping, law.stiffness)).then_some(time)
}

//! The energy that explicit steps gain, and what their method accounts for.
//!
//! Of an undamped mode symplectic Euler keeps v² + w² x² - y w x v, y = h w, and velocity Verlet v² + w² x² (1 - y²/4)
//! (docs/laws/integrators.md). So the energy swings about a mean by a share s of it, y / 2 or y² / 4, and is never more than
//! (1 + s) / (1 - s) times what it was: 2 s / (1 + s) of it may be gained. At the bound s is 1.

use serde::{Deserialize, Serialize};

use super::{
    evaluation::Evaluation, integrator::Integrator, model::Model, numbers::StepNumbers, rounding::rounding,
};
use crate::math::Real;

/// What is known of the energy over a run.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Gain {
    /// Of explicit steps: by how much it (J) is above that of the start, what pins and the medium gave since taken off. Of
    /// implicit ones: what contacts gave and nothing paid back yet.
    pub(crate) energy: f64,
    /// The longest sub-step so far over its bound.
    pub(crate) ratio: f64,
}

/// What is known of a state that a sub-step starts from.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Start {
    energy: f64,
    power: f64,
    rate: f64,
}

impl Start {
    pub(super) fn of<R: Real>(evaluation: &Evaluation<R>) -> Self {
        let total = &evaluation.total;
        Self { energy: total.energy(), power: total.power(), rate: evaluation.bound.rate }
    }
}

impl Start {
    /// Kinetic, elastic and gravitational energy (J).
    pub(super) fn energy(&self) -> f64 {
        self.energy
    }
}

impl Gain {
    /// After a sub-step. What pins and the medium give at its start and its end counts whole: together more than they gave.
    /// Where something touched a collider only a loss counts: what contact does to springs is not told apart.
    pub(super) fn after<R: Real>(
        self,
        model: &Model<R>,
        numbers: &StepNumbers<R>,
        start: &Start,
        end: &Evaluation<R>,
        touched: u64,
    ) -> Self {
        let Start { energy, power, rate } = Start::of(end);
        let given = numbers.dt * (start.power + power);
        let gain = energy - start.energy - given - 2.0 * rounding(model, numbers, &end.total, end.reach);
        let counted = if touched > 0 { gain.min(0.0) } else { gain };
        let ratio = numbers.dt * start.rate.max(rate);
        Self { energy: self.energy + counted, ratio: self.ratio.max(ratio.min(1.0)) }
    }

    /// What the energy may be above that of the start (J), where so much moves and is stretched (J).
    pub(super) fn limit(self, integrator: Integrator, moved: f64) -> f64 {
        let swing = match integrator {
            Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted => self.ratio * self.ratio,
            _ => self.ratio,
        };
        2.0 * swing / (1.0 + swing) * moved
    }
}

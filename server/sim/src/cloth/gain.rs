//! The energy that explicit steps gain, and what their method accounts for.
//!
//! Of an undamped mode symplectic Euler keeps v² + w² x² - y w x v, y = h w, and velocity Verlet v² + w² x² (1 - y²/4)
//! (docs/laws/integrators.md). So the energy swings about a mean by a share s of it, y / 2 or y² / 4: 2 s / (1 + s) of the
//! motion that a scene had may be gained, which is less than what theory gives to a mode that starts where its energy is
//! least. At the bound s is 1. Explicit Euler adds h² |a|² m / 2 per step to what falls freely, which is its own first-order
//! error and no growth.

use serde::{Deserialize, Serialize};

use super::{
    contact_gain::Judged, evaluation::Evaluation, integrator::Integrator, model::Model, numbers::StepNumbers,
    rounding::rounding,
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
    /// Of explicit steps: the most that moved and was stretched so far (J), less what was gained by then.
    pub(crate) motion: f64,
}

/// What is known of a state that a sub-step starts from.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Start {
    energy: f64,
    power: f64,
    rate: f64,
    /// What the method adds to a fall (J), by its definition.
    pub(super) own: f64,
}

impl Start {
    pub(super) fn of<R: Real>(evaluation: &Evaluation<R>) -> Self {
        let total = &evaluation.total;
        Self { energy: total.energy(), power: total.power(), rate: evaluation.bound.rate, own: 0.0 }
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
    /// Where what contacts give is not told apart only a loss counts.
    pub(super) fn after<R: Real>(
        self,
        model: &Model<R>,
        numbers: &StepNumbers<R>,
        start: &Start,
        end: &Evaluation<R>,
        judged: Judged,
    ) -> Self {
        let Start { energy, power, rate, .. } = Start::of(end);
        let given = numbers.dt * (start.power + power) + start.own;
        let gain = energy - start.energy - given - 2.0 * rounding(model, numbers, &end.total, end.reach);
        let counted = if judged == Judged::Yes { gain } else { gain.min(0.0) };
        let ratio = numbers.dt * start.rate.max(rate);
        let energy = self.energy + counted;
        let moved = end.total.kinetic_energy + end.total.elastic_energy;
        let motion = self.motion.max(moved - energy.max(0.0));
        Self { energy, ratio: self.ratio.max(ratio.min(1.0)), motion }
    }

    /// What the energy may be above that of the start (J).
    pub(super) fn limit(self, integrator: Integrator) -> f64 {
        let swing = match integrator {
            Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted => self.ratio * self.ratio,
            _ => self.ratio,
        };
        2.0 * swing / (1.0 + swing) * self.motion
    }
}

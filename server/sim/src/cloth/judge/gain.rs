//! The energy that explicit steps gain, and what their method accounts for.
//!
//! Of an undamped mode symplectic Euler keeps v² + w² x² - y w x v, y = h w, and velocity Verlet v² + w² x² (1 - y²/4)
//! (docs/laws/integrators.md). So the energy swings about a mean by a share s of it, y / 2 or y² / 4: 2 s / (1 + s) of the
//! motion that a scene had may be gained, which is less than what theory gives to a mode that starts where its energy is
//! least. At the bound s is 1. What the air and given forces do is known exactly, since they push by what they are at a kick: with
//! the mean of the velocities before it and after it. Explicit Euler adds h² |a|² m / 2 per step to what falls freely, which is its own first-order
//! error and no growth.

use super::rounding::rounding;
use crate::{
    cloth::{
        evaluate::{Evaluation, StepNumbers},
        layout::Model,
        settings::Integrator,
        state::{Gain, Judged, Start},
    },
    math::Real,
};

/// What is known of a state that was evaluated, and that a sub-step starts from.
pub(crate) fn start_of<R: Real>(evaluation: &Evaluation<R>) -> Start {
    let total = &evaluation.total;
    Start { energy: total.energy(), power: total.power(), rate: evaluation.bound.rate, own: 0.0 }
}

/// What was gained after a sub-step. What pins and the medium give at its start and its end counts whole: together more than
/// they gave. Where what contacts give is not told apart only a loss counts.
pub(crate) fn gained<R: Real>(
    before: Gain,
    model: &Model<R>,
    numbers: &StepNumbers<R>,
    start: &Start,
    end: &Evaluation<R>,
    judged: Judged,
) -> Gain {
    let Start { energy, power, rate, .. } = start_of(end);
    let given = numbers.dt * (start.power + power) + start.own;
    let rounding = rounding(model, numbers, &end.total, end.largest_coordinate);
    let gain = energy - start.energy - given - 2.0 * rounding;
    let counted = if judged == Judged::Yes { gain } else { gain.min(0.0) };
    let ratio = numbers.dt * start.rate.max(rate);
    let energy = before.energy + counted;
    let moved = end.total.kinetic_energy + end.total.elastic_energy;
    let motion = before.motion.max(moved - energy.max(0.0));
    Gain { energy, ratio: before.ratio.max(ratio.min(1.0)), motion }
}

/// What the energy may be above that of the start (J).
pub(crate) fn gain_limit(gain: Gain, integrator: Integrator) -> f64 {
    let swing = match integrator {
        Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted => gain.ratio * gain.ratio,
        _ => gain.ratio,
    };
    2.0 * swing / (1.0 + swing) * gain.motion
}

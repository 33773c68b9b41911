//! The energy that explicit steps gain, and what their method accounts for.
//!
//! Of an undamped mode symplectic Euler keeps v² + w² x² - y w x v, y = h w, and velocity Verlet v² + w² x² (1 - y²/4)
//! (docs/laws/integrators.md): in sums, the energy and h m a.v / 2, or the energy less h² m |a|² / 8. The energy swings about that, and
//! what the method keeps swings where motion is damped much: growth is what both show. Large motion adds to it, so a share of
//! the motion that a scene had may be gained: 2 s / (1 + s), s = y / 2 or y² / 4. At the bound s is 1. What the
//! medium and given forces do is known exactly, since they push by what they are at a kick: with the mean of the velocities
//! before it and after it. Explicit Euler adds h² |a|² m / 2 per step to what falls freely, which is its own first-order
//! error and no growth.

use super::rounding::rounding;
use crate::{
    cloth::{
        evaluate::{Evaluation, Judged, Start, StepNumbers, Total},
        layout::Model,
        settings::Integrator,
        state::Gain,
    },
    math::{Real, Vec3},
};

/// Roundings of a state by which a run may be above what it had.
const FLOOR: f64 = 64.0;

/// What is known of a state that was evaluated, and that a sub-step of `dt` (s) starts from.
pub(crate) fn start_of<R: Real>(
    model: &Model<R>,
    evaluation: &Evaluation<R>,
    integrator: Integrator,
    dt: f64,
) -> Start {
    let total = &evaluation.total;
    let kept = kept(model, total, integrator, dt);
    Start {
        energy: total.energy(),
        kept,
        total: *total,
        last_kick: *total,
        rate: evaluation.bound.rate,
        fall: 0.0,
        impulse: [0.0; 3],
        own: 0.0,
    }
}

/// What a method keeps of linear motion by steps of `dt` (s), less the energy (J); of a cloth that no pin holds of its inner motion.
fn kept<R: Real>(model: &Model<R>, total: &Total, integrator: Integrator, dt: f64) -> f64 {
    let [mut along, mut square, pushed @ ..] = total.swings;
    if model.is_loose() {
        let [momentum, pushed] = [total.momentum, pushed].map(Vec3::from);
        along -= momentum.dot(&pushed) / model.free_mass;
        square -= pushed.norm_squared() / model.free_mass;
    }
    match integrator {
        Integrator::SymplecticEuler => 0.5 * dt * along,
        Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted => -0.125 * dt * dt * square,
        _ => 0.0,
    }
}

/// What a method makes of the fall of a cloth that no pin holds (J): positions feel another velocity than the mean, by which gravity does work.
fn fall<R: Real>(
    (model, numbers, integrator): (&Model<R>, &StepNumbers<R>, Integrator),
    start: &Start,
    end: &Total,
) -> f64 {
    let (h, gravity) = (numbers.sub_step.dt, numbers.gravity.map(R::to_f64));
    let [before, after] = [start.total.momentum, end.momentum].map(Vec3::from);
    let [_, _, pushed @ ..] = start.total.swings;
    let moving = match integrator {
        _ if !model.is_loose() => return start.fall,
        Integrator::SymplecticEuler => after,
        Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted => {
            before + Vec3::from(pushed) * (0.5 * h)
        }
        _ => return 0.0,
    };
    h * gravity.dot(&((before + after) * 0.5 - moving))
}

/// What was gained after a sub-step, seen from the mean velocity of pins (m/s), after which so much energy moves and is stretched (J). What
/// pins give at its start and its end beside carrying what they hold counts whole: together more than they gave. Where
/// something began inside a solid only a loss counts.
pub(crate) fn gained<R: Real>(
    before: Gain,
    (model, numbers, integrator): (&Model<R>, &StepNumbers<R>, Integrator),
    start: &Start,
    end: &Evaluation<R>,
    (pins, moved): (Vec3<f64>, f64),
    judged: Judged,
) -> Gain {
    let Start { energy, kept, rate, .. } = start_of(model, end, integrator, numbers.sub_step.dt);
    // What a surface stops gets back what its method lost in the fall.
    let is_free = start.impulse == [0.0; 3];
    let fall = if is_free { fall((model, numbers, integrator), start, &end.total) } else { 0.0 };
    let dt = numbers.sub_step.dt;
    let [first, last] = [&start.total, &end.total];
    let beside = [first, last].map(|total| total.pin_work_from(pins).max(0.0));
    let carried = 0.5 * (first.pins_along(pins) + start.last_kick.pins_along(pins));
    let given = dt * (beside[0] + beside[1] + carried) + start.own;
    let rounding = rounding(model, numbers, last, end.largest_coordinate);
    let gain = energy - start.energy - given - 2.0 * rounding;
    let counted = |gain: f64| if judged == Judged::Yes { gain } else { gain.min(0.0) };
    let ratio = dt * start.rate.max(rate);
    let after = Gain {
        energy: before.energy + counted(gain - fall),
        kept: before.kept + counted(gain + kept - start.kept - if model.is_loose() { fall } else { 0.0 }),
        ratio: before.ratio.max(ratio.min(1.0)),
        motion: before.motion,
    };
    Gain { motion: before.motion.max(moved - after.grown().max(0.0)), ..after }
}

/// What the energy may be above that of the start (J), of which a state has so much rounding (J).
pub(crate) fn gain_limit(gain: Gain, integrator: Integrator, rounding: f64) -> f64 {
    let swing = match integrator {
        Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted => gain.ratio * gain.ratio,
        _ => gain.ratio,
    };
    2.0 * swing / (1.0 + swing) * gain.motion + FLOOR * rounding
}

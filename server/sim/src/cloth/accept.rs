//! Whether an implicit sub-step is accepted: what its linear solve promised is compared with what came of it.
//!
//! An implicit Euler step minimises the incremental potential G(x) = |x - y|²_M / (2 h²) + E(x), y = x_n + h v_n with what
//! gravity adds, from x = x_n on; one Newton step of it is Baraff and Witkin's. With dv = v' - v, the fall of G is
//!
//!   |v|²_M / 2 - |dv|²_M / 2 + P(x_n) - P(x'), P elastic and gravitational energy, less what the medium takes,
//!
//! and the fall that the linear solve predicts |v|²_M / 2 + s + b.dv - dv.A dv / 2, where s is that of P and of what
//! damping takes, to second order, if all goes on at v. The work of pins on their way counts for both, and both come with
//! the evaluation of a state and the sweeps of the solve. Damping of springs is left out of the fall, which can only
//! make it greater.

use super::{
    evaluation::Evaluation, figures::Total, judge::fastest, model::Model, moved::Motion,
    numbers::StepNumbers, state::State,
};
use crate::{math::Real, report::StepFailure};

/// Least share of the predicted fall that the fall must be (Armijo's rule); and of it the most by which the energy may
/// rise. One linear solve per step carries particles that turn along tangents, and so stretches what turns: a rule
/// without a share would refuse a sheet that spins freely, at any length of the step.
const SHARE: f64 = 0.1;

/// What is known before a step, to judge it by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Before {
    total: Total,
    reach: f64,
}

impl Before {
    pub(super) fn of<R: Real>(evaluation: &Evaluation<R>) -> Self {
        Self { total: evaluation.total, reach: evaluation.reach }
    }
}

/// What a step found: how particles moved, by how much the solve lowered b.dv - dv.A dv / 2 (J), and the evaluation of
/// its end.
pub(super) struct After<'a, R: Real> {
    pub(super) motion: &'a Motion,
    pub(super) descent: f64,
    pub(super) evaluation: &'a Evaluation<R>,
    pub(super) state: &'a State<R>,
}

/// Says why a step is not accepted, if it is not. All numbers are finite.
pub(super) fn accept<R: Real>(
    model: &Model<R>,
    numbers: &StepNumbers<R>,
    before: &Before,
    after: &After<'_, R>,
) -> Option<StepFailure> {
    let (old, new) = (&before.total, &after.evaluation.total);
    let potential = |total: &Total| total.elastic_energy + total.gravitational_energy;
    let [own, along] = after.motion.medium;
    let drag = numbers.dt * numbers.drag.to_f64();

    // Forces on pins are those that the old and the new state predict for the end of a step: together more than pins do.
    let pins = old.pin_work.max(0.0) + new.pin_work.max(0.0);
    let predicted = old.kinetic_energy + old.slope + after.descent + pins;
    let fall = old.kinetic_energy - after.motion.change + potential(old)
        - potential(new)
        - drag * (0.5 * own - along)
        + pins;
    let rounding = rounding(model, numbers, before, after);
    let particle = || fastest(model, after.state);
    if fall < SHARE * predicted - rounding {
        return Some(StepFailure::Descent { particle: particle(), value: fall, predicted, limit: SHARE });
    }

    let gain = new.kinetic_energy - old.kinetic_energy + potential(new) - potential(old);
    let limit = drag * (along - own) + pins + SHARE * predicted.max(0.0) + rounding;
    (gain > limit).then(|| StepFailure::EnergyGain { particle: particle(), value: gain, limit })
}

/// A bound on what rounding does to the energies of both states (J): positions are off by a rounding of the largest, e,
/// against the tensions, which add up to sqrt(2 k E) at most, against the stiffness itself, and against the weight.
fn rounding<R: Real>(
    model: &Model<R>,
    numbers: &StepNumbers<R>,
    before: &Before,
    after: &After<'_, R>,
) -> f64 {
    let of = |total: &Total, reach: f64| {
        let e = 4.0 * R::ROUNDING * reach;
        let tension = (2.0 * numbers.stiffness * total.elastic_energy).sqrt();
        let weight = model.free_mass * numbers.gravity.map(R::to_f64).norm();
        e * (tension + e * numbers.stiffness + weight) + 8.0 * R::ROUNDING * total.kinetic_energy
    };
    of(&before.total, before.reach) + of(&after.evaluation.total, after.evaluation.reach)
}

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
//!
//! What moves as a whole says nothing about a step, and is much where the scene is seen from a train. So both falls are those from where each
//! part goes on as a whole, which is the minimum of G over such motion, and the work of pins is what they do beside carrying
//! what they hold along.

use super::{energies::risen_most, rounding::rounding};
use crate::{
    cloth::{
        contact::PairEnergy,
        evaluate::{Allowance, Common, Evaluation, Judged, Motion, StepNumbers, Total},
        layout::Model,
        state::State,
    },
    math::Real,
    report::StepFailure,
};

/// Least share of the predicted fall that the fall must be (Armijo's rule); and of it the most by which the energy may
/// rise. One linear solve per step carries particles that turn along tangents, and so stretches what turns: a rule
/// without a share would refuse a sheet that spins freely, at any length of the step.
const SHARE: f64 = 0.1;
/// The same of a step that ends beyond its minimum, as the implicit midpoint's does: what turns is no reason there, but the
/// energy that is kept is that of linear motion alone.
const BEYOND_SHARE: f64 = 1e-3;
/// The same of a midpoint that one linear solve led to: it stretches what turns, and damps nothing that would take that back.
const MIDDLE_SHARE: f64 = 0.01;
/// Share of the kinetic and elastic energy that may be owed for such midpoints, one after the other.
const MIDDLE_OWED: f64 = 0.05;
/// The same of steps in which surfaces push each other apart.
const SURFACES_OWED: f64 = 1e-3;

/// Roundings of sums in binary64 by which what parts do as a whole may be off.
const WHOLE_ROUNDINGS: f64 = 64.0;

/// What is known before a step, to judge it by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Before {
    total: Total,
    largest_coordinate: f64,
}

impl Before {
    pub(crate) fn of<R: Real>(evaluation: &Evaluation<R>) -> Self {
        Self { total: evaluation.total, largest_coordinate: evaluation.largest_coordinate }
    }
}

/// Where what a sub-step minimises was looked at last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Found {
    /// One linear solve from the state: at the end of the sub-step.
    End,
    /// The same, at the middle.
    Middle {
        /// Elastic and gravitational energy there (J).
        potential: f64,
        /// Work of pins on their way, by the forces there (J).
        pin_work: f64,
    },
    /// At the last iterate.
    Iterate {
        /// |u - V|²_M / 2 where X + h u is x_n, with the potential of the medium (J).
        inertia: f64,
        /// Elastic and gravitational energy at the iterate (J).
        potential: f64,
        /// Work of pins on their way, by the forces at the first and the last iterate (J).
        pin_work: f64,
        /// What a fixed number of sweeps may leave over of what acts on the whole (J): 0 of what ends by a tolerance.
        left: f64,
    },
}

/// What a step found: how particles moved, by how much the solve lowered b.dv - dv.A dv / 2 (J), where, and the
/// evaluation of its end.
pub(crate) struct After<'a, R: Real> {
    pub(crate) motion: &'a Motion,
    pub(crate) descent: f64,
    pub(crate) found: Found,
    pub(crate) evaluation: &'a Evaluation<R>,
    /// The state before the step, and that to which it leads.
    pub(crate) states: [&'a State<R>; 2],
    /// What was gained before and not lost again (J).
    pub(crate) owed: f64,
    /// Of pairs that keep surfaces apart.
    pub(crate) pairs: PairEnergy,
    /// What parts do as a whole.
    pub(crate) common: &'a Common,
}

/// By how much what a step minimises falls (J).
#[derive(Clone, Copy)]
struct Falls {
    /// From where each part goes on as a whole.
    fall: f64,
    /// The same as its solve promises it.
    predicted: f64,
    /// What pins on their way give, at most.
    pins: f64,
    pairs: PairEnergy,
    /// What rounding does to these, at most.
    rounding: f64,
}

impl Falls {
    fn of<R: Real>(
        model: &Model<R>,
        numbers: &StepNumbers<R>,
        before: &Before,
        after: &After<'_, R>,
    ) -> Self {
        let (old, new) = (&before.total, &after.evaluation.total);
        let Motion { change, own, along, .. } = *after.motion;

        // Forces on pins are those that the old and the new state predict for the end of a step, or the first and the last iterate
        // have: together more than pins do.
        let common = after.common;
        let pins = |work: f64| old.pin_work_from(common.pins).max(0.0) + work.max(0.0);
        let (inertia, potential, pins) = match after.found {
            Found::End => (old.kinetic_energy, new.potential(), pins(new.pin_work_from(common.pins))),
            Found::Middle { potential, pin_work } => (old.kinetic_energy, potential, pins(pin_work)),
            Found::Iterate { inertia, potential, pin_work, .. } => (inertia, potential, pin_work),
        };
        let medium = numbers.scheme.h * (0.5 * own - along);
        let pairs = after.pairs;
        let PairEnergy { start, at_velocity, end, .. } = pairs;
        let whole = inertia - common.descent;
        let fall = whole - change + old.potential() - potential - medium + pins + (start - end);
        let predicted = match after.found {
            Found::Iterate { .. } => fall.max(0.0),
            Found::End | Found::Middle { .. } => {
                whole + old.slope() + after.descent + pins + (start - at_velocity)
            }
        };
        let rounding = rounding(model, numbers, old, before.largest_coordinate)
            + rounding(model, numbers, new, after.evaluation.largest_coordinate)
            + WHOLE_ROUNDINGS * f64::EPSILON * (common.descent.abs() + common.kinetic[0] + common.kinetic[1]);
        Self { fall, predicted, pins, pairs, rounding }
    }
}

/// The energy (J) that moves and is stretched at the start of an implicit step or where it was solved for, the greater one, without what
/// parts do as a whole.
pub(crate) fn moving([start, solved]: [&Total; 2], common: &Common) -> f64 {
    let [first, _] = common.kinetic;
    (start.moved() - first).max(solved.moved() - common.at_solution).max(0.0)
}

/// Whether what a step minimises falls less than its one linear solve promised, by more than a share of the energy that moves and is
/// stretched. The evaluation is that of what was solved for.
pub(crate) fn falls_short<R: Real>(
    model: &Model<R>,
    numbers: &StepNumbers<R>,
    before: &Before,
    after: &After<'_, R>,
    accuracy: f64,
) -> bool {
    let Falls { fall, predicted, rounding, .. } = Falls::of(model, numbers, before, after);
    predicted - fall > accuracy * moving([&before.total, &after.evaluation.total], after.common) + rounding
}

/// What energy a step may have that is accepted.
///
/// # Errors
/// Why it is not accepted. All numbers are finite.
pub(crate) fn accept<R: Real>(
    model: &Model<R>,
    numbers: &StepNumbers<R>,
    before: &Before,
    after: &After<'_, R>,
) -> Result<Allowance, StepFailure> {
    let (old, new) = (&before.total, &after.evaluation.total);
    let common = after.common;
    let Falls { fall, predicted, pins, pairs, rounding } = Falls::of(model, numbers, before, after);
    let left = match after.found {
        Found::Iterate { left, .. } => left,
        Found::End | Found::Middle { .. } => 0.0,
    };
    let particle = || risen_most(model, numbers, after.states);
    if fall < SHARE * predicted - rounding - left {
        return Err(StepFailure::Descent { particle: particle(), value: fall, predicted, limit: SHARE });
    }

    let gain = new.kinetic_energy - old.kinetic_energy + new.potential() - old.potential();
    let Motion { own, along, .. } = *after.motion;
    let PairEnergy { given: by_pairs, has_any, .. } = pairs;
    let medium = numbers.sub_step.dt * (along - own);
    let given = medium + numbers.sub_step.dt / numbers.scheme.h * pins + common.carried + by_pairs;
    let share = match after.found {
        Found::Iterate { .. } if numbers.scheme.beyond > 1.0 => BEYOND_SHARE,
        Found::Middle { .. } => MIDDLE_SHARE,
        Found::Iterate { .. } | Found::End => SHARE,
    };
    // What a midpoint gains adds up, since it damps nothing: over the run, no more than a share of what moves.
    let moved = |total: &Total, whole: f64| total.moved() - whole;
    let [first, last] = common.kinetic;
    let moves = moved(old, first).max(moved(new, last));
    let room = match after.found {
        Found::Middle { .. } => (MIDDLE_OWED * moves - after.owed).max(0.0),
        Found::End if has_any => (SURFACES_OWED * moves - after.owed).max(0.0),
        Found::Iterate { .. } | Found::End => f64::INFINITY,
    };
    let limit = given + (share * predicted.max(0.0)).min(room) + rounding + left;
    // A corner of a figure that gives way takes energy and gives it back, which nobody counts.
    let is_judged = !model.gives_way(&after.states[1].dv);
    if is_judged && gain > limit {
        return Err(StepFailure::EnergyGain { particle: particle(), value: gain, limit });
    }
    let judged = Judged::from(is_judged);
    let owes = matches!(after.found, Found::Middle { .. }) || has_any;
    let limit = gain.max(given) + rounding;
    let at_rest = common.lost - (medium - numbers.sub_step.dt * common.pushed).min(0.0);
    Ok(Allowance { given: given + rounding, at_rest, limit, judged, owes, totals: [*old, *new] })
}

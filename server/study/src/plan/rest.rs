//! What a scene saves if cloth that lies still sleeps: what is recommended run so, with what its error leaves of the tolerance.

use nappe_sim::cloth::{Integrator, Minimizer, RestSettings};

use super::terms::Recommended;
use crate::{
    chart::median_seconds,
    method::Stepped,
    run::{End, Phase, Run, run},
};

/// What is recommended, of which what lies still sleeps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rested {
    /// The error (m) of `[rest]`.
    pub error: f64,
    /// By how much positions are said to be off (m), at most; 0 where nothing slept.
    pub told: f64,
    /// How far (m) the answer moves, as terms move it.
    pub measured: f64,
    /// The share of evaluations and products that is saved.
    pub saved_counts: f64,
    /// The share of seconds that is saved.
    pub saving: Option<f64>,
}

/// Runs what is recommended with `[rest]`, and without; none where it cannot sleep, or there is no time for it.
pub(super) fn rested(recommended: &Recommended<'_>, phase: &Phase, tell: &dyn Fn(&str)) -> Option<Rested> {
    let stepped = recommended.found.row.stepped;
    let Stepped::Cloth(setting) = stepped else { return None };
    let is_one = matches!(setting.method.minimizer, Minimizer::OneStep | Minimizer::Auto { .. });
    let can_sleep = setting.method.integrator == Integrator::ImplicitEuler && is_one;
    let error = recommended.allowed();
    if !can_sleep || error <= 0.0 || phase.is_over() {
        return None;
    }
    tell("with what lies still asleep");
    let rest = RestSettings { error, within: recommended.times.end(), sleep: true };
    let made = run(&recommended.case.resting(rest), stepped, recommended.times, phase);
    if made.end != End::Reached {
        return None;
    }
    let whole = run(recommended.case, stepped, recommended.times, phase);
    if whole.end != End::Reached {
        return None;
    }
    let counts = |run: &Run| (run.work.force_evaluations + run.work.matrix_products) as f64;
    let [left, all] = [&made, &whole].map(|run| median_seconds(&run.seconds));
    Some(Rested {
        error,
        told: made.told,
        measured: recommended.change(&whole, &made, None),
        saved_counts: 1.0 - counts(&made) / counts(&whole).max(1.0),
        saving: left.zip(all).map(|(left, all)| 1.0 - left / all).filter(|share| share.is_finite()),
    })
}

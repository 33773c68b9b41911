//! Every method as the program runs it: steps certified before, or accepted after.

use super::{
    ground::Ground,
    probe::{AsRun, Probe, UnderLoad},
    row::{Fate, Over, StabilityRow, Stepping},
};
use crate::{
    case::Case,
    method::{Method, Setting, Steps},
    run::Phase,
};

/// Times the scene's own step that worlds are stepped at.
pub(super) const TIMES: [f64; 4] = [1.0, 4.0, 16.0, 64.0];
/// Share of the bound that a scene uses which names none.
const SAFETY: f64 = nappe_sim::time_step::TimeStep::SAFETY;

/// Runs a method in steps of the world that are so many times the scene's.
pub(super) fn run(
    case: &Case,
    method: Method,
    times: f64,
    against: (&Ground, f64),
    phase: &Phase,
) -> StabilityRow {
    let (ground, tolerance) = against;
    let dt = times * case.dt();
    let probe = Probe { case, method, dt, steps: ground.steps(dt), over: Over::Scene };
    let setting = Setting::new(method, case.precision, Steps::Certified(SAFETY));
    let setting = setting.solved(case, tolerance, ground.window.max(dt));
    let row = probe.run_as(setting, &mut AsRun(UnderLoad::new(case, ground, tolerance)), phase);
    let [substeps, rejected] = row.taken;
    let (fate, cause) = match row.fate {
        Fate::Stable if rejected == 0 && substeps == probe.steps => (Fate::Survived, None),
        Fate::Stable => {
            let per_step = substeps as f64 / probe.steps as f64;
            (Fate::Recovered, Some(format!("{per_step:.1} sub-steps per step, {rejected} taken again")))
        }
        Fate::Diverged | Fate::Refused => (Fate::Detected, row.cause.clone()),
        Fate::Grows => (Fate::Lost, row.cause.clone()),
        other => (other, row.cause.clone()),
    };
    StabilityRow { fate, cause, stepping: Stepping::Certified, method, ..row }
}

//! Every method as the program runs it: steps certified before, or accepted after.

use super::{
    ground::Ground,
    probe::{AsRun, Probe, UnderLoad},
    row::{Over, StabilityRow, Stepping},
};
use crate::{
    case::Case,
    method::{Method, Setting, Steps},
    run::{Phase, Verdict},
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
    let (verdict, cause) = match row.verdict {
        Verdict::Stable if rejected == 0 && substeps == probe.steps => (Verdict::Survived, None),
        Verdict::Stable => {
            let per_step = substeps as f64 / probe.steps as f64;
            (Verdict::Recovered, Some(format!("{per_step:.1} sub-steps per step, {rejected} taken again")))
        }
        Verdict::Refused if row.is_refused() => (Verdict::Refused, row.cause.clone()),
        Verdict::Diverged | Verdict::Refused => (Verdict::Detected, row.cause.clone()),
        Verdict::Grows => (Verdict::Lost, row.cause.clone()),
        Verdict::Wrong
        | Verdict::Indefinite
        | Verdict::NotKnown
        | Verdict::Survived
        | Verdict::Recovered
        | Verdict::Detected
        | Verdict::Warned
        | Verdict::Lost
        | Verdict::None => (row.verdict, row.cause.clone()),
    };
    StabilityRow { verdict, cause, stepping: Stepping::Certified, method, ..row }
}

//! A run of cloth whose every step is looked at.

use nappe_sim::{
    cloth::Integrator,
    math::Precision,
    report::{NoStopwatch, StepReport},
    world::{Change, SetupError, Simulation},
};

use super::{
    finding::Finding,
    scene::{Scene, positions},
};
use crate::run::Verdict;

/// A scene, and how long it runs.
pub(super) struct Trial {
    pub(super) scene: Scene,
    pub(super) precision: Precision,
    pub(super) steps: u64,
    /// Changes, each after so many steps.
    pub(super) changes: Vec<(u64, Change)>,
    /// Energy (J) that pins may give over the run.
    pub(super) given: f64,
}

/// Share of the kinetic and elastic energy by which a run may gain energy; beyond it, it is wrong.
const WRONG: f64 = 0.1;

/// How much energy a run may have above that of its start without saying so, and at all, as shares of what moves or is
/// stretched now. Of implicit methods rounding, and what acceptance lets one linear solve gain; of explicit ones the error of
/// a fine step, and what they swing by in theory at 0.9 of the bound, y = 1.8 (docs/laws/steps.md).
fn gains(integrator: Integrator) -> [f64; 2] {
    let swing = match integrator {
        _ if integrator.is_implicit() => return [1e-6, WRONG],
        Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted => 0.81,
        _ => 0.9,
    };
    [WRONG, 2.0 * swing / (1.0 + swing)]
}

impl Trial {
    /// In binary64 without changes.
    pub(super) fn new(scene: Scene, steps: u64) -> Self {
        Self { scene, precision: Precision::F64, steps, changes: Vec::new(), given: 0.0 }
    }

    /// Runs it. A step that is taken must leave all finite, and no more energy than the scene has; each is shown to `look`.
    pub(super) fn run_with(self, mut look: impl FnMut(&Simulation, &StepReport)) -> Finding {
        let mut simulation = match Simulation::new(&self.scene.setup(), self.precision) {
            Ok((simulation, _)) => simulation,
            Err(error) => return refused(&error),
        };
        let [silent, most] = gains(self.scene.settings.integrator);
        let mut gained = 0.0;
        let mut start = simulation.diagnose().total_energy();
        let (mut substeps, mut rejected) = (0, 0);
        for step in 0..self.steps {
            let due = self.changes.iter().filter(|(at, _)| *at == step);
            let due: Vec<_> = due.map(|(_, change)| change.clone()).collect();
            if !due.is_empty() {
                if let Err(error) = simulation.apply(&due) {
                    return Finding::new(Verdict::Lost, error.to_string());
                }
                start = simulation.diagnose().total_energy();
            }
            let report = match simulation.step(&mut NoStopwatch) {
                Ok(report) => report,
                Err(error) => return Finding::stopped(&error),
            };
            let now = report.diagnostics;
            let moved = now.kinetic_energy + now.elastic_energy;
            let gain = now.total_energy() - start - self.given - 1e-9 * start.abs();
            let share = if gain > 0.0 { gain / moved } else { 0.0 };
            if !gain.is_finite() || share > most {
                return Finding::new(Verdict::Lost, format!("{gain:.1e} J gained at step {step}"));
            }
            gained = f64::max(gained, share);
            if !positions(&simulation).iter().flatten().all(|c| c.is_finite()) {
                return Finding::new(Verdict::Lost, format!("not finite at step {step}"));
            }
            let steps = report.cloth.map_or([1, 0], |cloth| [cloth.substeps, cloth.rejected]);
            substeps += u64::from(steps[0]);
            rejected += steps[1];
            look(&simulation, &report);
        }
        let taken = if rejected == 0 && substeps > self.steps {
            Finding::new(Verdict::Recovered, "shorter steps")
        } else {
            Finding::taken(rejected)
        };
        let told =
            if gained > silent { taken.with(&format!("gains {gained:.0e} of its energy")) } else { taken };
        told.right_if(|| gained <= WRONG)
    }

    /// Runs it, without a look.
    pub(super) fn run(self) -> Finding {
        self.run_with(|_, _| ())
    }
}

fn refused(error: &SetupError) -> Finding {
    let message = error.to_string();
    let never = "no step is stable";
    Finding::new(Verdict::Detected, if message.contains(never) { never.to_owned() } else { message })
}

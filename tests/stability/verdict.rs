//! What becomes of a method in a scene: a run whose every step is looked at.

use std::fmt;

use nappe_sim::{
    cloth::Integrator,
    math::Precision,
    report::{StepError, StepReport},
    world::{Change, SetupError, Simulation},
};
use nappe_tests::{
    Scene,
    scene::{positions, try_advance},
};

/// What became of it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Verdict {
    /// It did what it should, and what is worth a number.
    Survived(String),
    /// It did so in steps other than those asked for.
    Recovered(String),
    /// It did not, and says so.
    Detected(String),
    /// It may not, and said so before the first step; what was sent is as right as the warning says.
    Warned(String),
    /// It did not, and does not say so.
    Lost(String),
    /// The scene does not concern it.
    None,
}

impl Verdict {
    /// All steps were taken, some of them again.
    pub(crate) fn taken(rejected: u32) -> Self {
        match rejected {
            0 => Self::Survived(String::new()),
            1 => Self::Recovered("1 step again".to_owned()),
            _ => Self::Recovered(format!("{rejected} steps again")),
        }
    }

    /// A step failed, and the program said why.
    pub(crate) fn stopped(error: &StepError) -> Self {
        Self::Detected(format!("`{}` at step {}", error.failure.reason(), error.step))
    }

    /// Survived, or recovered if it was that already.
    pub(crate) fn with(self, what: String) -> Self {
        match self {
            Self::Survived(how) if how.is_empty() => Self::Survived(what),
            Self::Survived(how) => Self::Survived(format!("{how}; {what}")),
            Self::Recovered(how) => Self::Recovered(format!("{how}; {what}")),
            other => other,
        }
    }

    /// Lost, unless something holds that must.
    pub(crate) fn only_if(self, holds: impl Fn() -> bool, otherwise: impl FnOnce() -> String) -> Self {
        match self {
            Self::Survived(_) | Self::Recovered(_) if !holds() => Self::Lost(otherwise()),
            other => other,
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Survived(what) if what.is_empty() => f.write_str("survived"),
            Self::Survived(what) => write!(f, "survived: {what}"),
            Self::Recovered(how) => write!(f, "recovered: {how}"),
            Self::Detected(how) => write!(f, "detected: {how}"),
            Self::Warned(how) => write!(f, "warned: {how}"),
            Self::Lost(how) => write!(f, "LOST: {how}"),
            Self::None => f.write_str("-"),
        }
    }
}

/// A scene, and how long it runs.
pub(crate) struct Trial {
    pub(crate) scene: Scene,
    pub(crate) precision: Precision,
    pub(crate) steps: u64,
    /// Changes, each after so many steps.
    pub(crate) changes: Vec<(u64, Change)>,
    /// Energy (J) that pins may give over the run.
    pub(crate) given: f64,
}

/// How much energy a run may have above that of its start without saying so, and at all, as shares of what moves or is
/// stretched now. Of implicit methods rounding, and what acceptance lets one linear solve gain; of explicit ones the error of
/// a fine step, and what they swing by in theory at 0.9 of the bound, y = 1.8 (docs/laws/steps.md).
fn gains(integrator: Integrator) -> [f64; 2] {
    let swing = match integrator {
        _ if integrator.is_implicit() => return [1e-6, 0.1],
        Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted => 0.81,
        _ => 0.9,
    };
    [0.1, 2.0 * swing / (1.0 + swing)]
}

impl Trial {
    /// In binary64 without changes.
    pub(crate) fn new(scene: Scene, steps: u64) -> Self {
        Self { scene, precision: Precision::F64, steps, changes: Vec::new(), given: 0.0 }
    }

    /// Runs it. A step that is taken must leave all finite, and no more energy than the scene has; each is shown to `look`.
    pub(crate) fn run_with(self, mut look: impl FnMut(&Simulation, &StepReport)) -> Verdict {
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
                simulation.apply(&due).expect("a change that is allowed");
                start = simulation.diagnose().total_energy();
            }
            let report = match try_advance(&mut simulation, 1) {
                Ok(report) => report,
                Err(error) => return Verdict::stopped(&error),
            };
            let now = report.diagnostics;
            let moved = now.kinetic_energy + now.elastic_energy;
            let gain = now.total_energy() - start - self.given - 1e-9 * start.abs();
            let share = if gain > 0.0 { gain / moved } else { 0.0 };
            if !gain.is_finite() || share > most {
                return Verdict::Lost(format!("{gain:.1e} J gained at step {step}"));
            }
            gained = f64::max(gained, share);
            if !positions(&simulation).iter().flatten().all(|c| c.is_finite()) {
                return Verdict::Lost(format!("not finite at step {step}"));
            }
            let cloth = report.cloth.expect("a cloth");
            substeps += u64::from(cloth.substeps);
            rejected += cloth.rejected;
            look(&simulation, &report);
        }
        let taken = if rejected == 0 && substeps > self.steps {
            Verdict::Recovered("shorter steps".to_owned())
        } else {
            Verdict::taken(rejected)
        };
        if gained > silent { taken.with(format!("gains {gained:.0e} of its energy")) } else { taken }
    }

    /// Runs it, without a look.
    pub(crate) fn run(self) -> Verdict {
        self.run_with(|_, _| ())
    }
}

fn refused(error: &SetupError) -> Verdict {
    let message = error.to_string();
    let never = "no step is stable";
    Verdict::Detected(if message.contains(never) { never.to_owned() } else { message })
}

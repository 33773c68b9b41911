//! What becomes of a method in a scene: a run whose every step is looked at.

use std::fmt;

use nappe_sim::{
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
            Self::Survived(_) => Self::Survived(what),
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
}

/// How much energy a run may have above that of its start, as a share of what moves or is stretched now: certified explicit
/// steps swing by up to nearly half of it.
const GAIN: f64 = 0.5;

impl Trial {
    /// In binary64 without changes.
    pub(crate) fn new(scene: Scene, steps: u64) -> Self {
        Self { scene, precision: Precision::F64, steps, changes: Vec::new() }
    }

    /// Runs it. A step that is taken must leave all finite, and no more energy than the scene has; each is shown to `look`.
    pub(crate) fn run_with(self, mut look: impl FnMut(&Simulation, &StepReport)) -> Verdict {
        let mut simulation = match Simulation::new(&self.scene.setup(), self.precision) {
            Ok((simulation, _)) => simulation,
            Err(error) => return refused(&error),
        };
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
            let gain = now.total_energy() - start;
            if !gain.is_finite() || gain > GAIN * moved + 1e-9 * start.abs() {
                return Verdict::Lost(format!("{gain:.1e} J gained at step {step}"));
            }
            if !positions(&simulation).iter().flatten().all(|c| c.is_finite()) {
                return Verdict::Lost(format!("not finite at step {step}"));
            }
            let cloth = report.cloth.expect("a cloth");
            substeps += u64::from(cloth.substeps);
            rejected += cloth.rejected;
            look(&simulation, &report);
        }
        if rejected == 0 && substeps > self.steps {
            return Verdict::Recovered("shorter steps".to_owned());
        }
        Verdict::taken(rejected)
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

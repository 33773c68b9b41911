//! What a reference takes on this machine: a few steps are measured, and a class of effort is chosen that can be paid.

use nappe_sim::{math::Precision, snow::SnowSetup};

use super::{
    effort::{Effort, OVERHEAD},
    nearest::NoReference,
    window::{at_level, certified, counted, first_level, shortest},
};
use crate::{
    case::{Case, Times},
    method::{SnowSetting, Stepped},
    run::{End, Phase, Runner},
};

/// Seconds for which steps are measured, at most, and the share of the time that is left.
const MEASURED: f64 = 0.2;
const SHARE: f64 = 0.1;
/// How many times as long as it was measured the work of a class may take.
const ROOM: f64 = 1.25;

/// The work of a class of cloth, in that of one run: three copies of the scene, which take half of it each, and runs of the reference,
/// each of twice the work of the one before. The least that is compared takes three copies, a run, and one of half its steps.
const CLOTH: [f64; 2] = [3.5, 6.0];
/// The same of snow: the scene as it is written, the same once more, and one on cells half as long, which takes 16 times as much.
const SNOW: [f64; 2] = [1.2, 18.0];

/// A class of effort, and what it takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Chosen {
    pub(crate) effort: Effort,
    /// Seconds that the reference takes at most, as its first steps were measured; none where time is not limited.
    pub(crate) most: Option<f64>,
}

impl Chosen {
    /// The class that is asked for, or the default, of which nothing was measured.
    fn unmeasured(asked: Option<Effort>) -> Self {
        Self { effort: asked.unwrap_or(Effort::DEFAULT), most: None }
    }

    /// What is done now, with the class and what it takes.
    pub(crate) fn told(&self, what: &str) -> String {
        let most = self.most.map_or_else(String::new, |most| format!(", at most {most:.0} s as it looks"));
        format!("{what} (effort {}{most})", self.effort)
    }
}

/// What is measured, and what a class of it takes.
struct Measured {
    stepped: Stepped,
    times: Times,
    /// Particles, as they count.
    particles: f64,
    /// Work of a run of a class.
    of: fn(Effort) -> u64,
    /// The work of a class over that of a run, and the least work over that of the steps that are measured.
    runs: [f64; 2],
}

/// A class of effort for the cloths of a case: that which is asked for, or the largest that a phase can pay; without a limit of time the
/// default. The case ends at a time (s); it is compared until another (s) at least, if one is asked for.
///
/// # Errors
/// Time is not enough for the least that can be compared; about how much it takes.
pub(crate) fn chosen(
    case: &Case,
    asked: Option<Effort>,
    [end, least]: [f64; 2],
    phase: &Phase,
) -> Result<Chosen, NoReference> {
    if phase.left().is_infinite() {
        return Ok(Chosen::unmeasured(asked));
    }
    let spacing = shortest(case, end);
    let times = Times::even(spacing, 1);
    // Where no run can begin, copies will tell why.
    let runner = Runner::start(case, &at_level(case, 0), &times, phase);
    let Ok(bound) = runner.map(|runner| certified(case, &runner)) else {
        return Ok(Chosen::unmeasured(asked));
    };
    let level = first_level(case, spacing, bound);
    let measured = Measured {
        stepped: Stepped::Cloth(at_level(case, level)),
        times,
        particles: case.particle_count() as f64 + OVERHEAD as f64,
        of: Effort::of_cloth,
        runs: CLOTH,
    };
    measured.chosen(case, asked, [end, least.max(spacing)], phase)
}

/// The same of the snow of a case.
///
/// # Errors
/// Time is not enough for the least that can be compared; about how much it takes.
pub(crate) fn chosen_of_snow(
    (case, snow): (&Case, &SnowSetup),
    asked: Option<Effort>,
    [end, least]: [f64; 2],
    phase: &Phase,
) -> Result<Chosen, NoReference> {
    if phase.left().is_infinite() {
        return Ok(Chosen::unmeasured(asked));
    }
    let measured = Measured {
        stepped: Stepped::Snow(SnowSetting::own(snow, Precision::F32, 0)),
        times: Times::even(case.dt(), 1),
        particles: case.particle_count() as f64,
        of: Effort::of_snow,
        runs: SNOW,
    };
    measured.chosen(case, asked, [end, least.max(case.dt())], phase)
}

impl Measured {
    /// A class for a case that ends at a time (s) and is compared until another (s) at least.
    fn chosen(
        &self,
        case: &Case,
        asked: Option<Effort>,
        [end, least]: [f64; 2],
        phase: &Phase,
    ) -> Result<Chosen, NoReference> {
        let seconds = MEASURED.min(SHARE * phase.left());
        let Ok(mut runner) = Runner::start(case, self.stepped, &self.times, phase) else {
            return Ok(Chosen::unmeasured(asked));
        };
        loop {
            match runner.advance() {
                Ok(_) if runner.elapsed() >= seconds || runner.time() >= end => break,
                Ok(_) => {}
                Err(End::Failed(_)) => return Ok(Chosen::unmeasured(asked)),
                Err(End::Reached | End::Cut(_) | End::Costly) => {
                    return Err(NoReference::Time(f64::INFINITY));
                }
            }
        }
        let [all, fewest] = self.runs;
        let needed = fewest * least * runner.elapsed() / runner.time();
        if needed > phase.left() {
            return Err(NoReference::Time(needed));
        }
        let work = match self.stepped {
            Stepped::Cloth(_) => counted(runner.work()),
            Stepped::Snow(_) => runner.work().force_evaluations,
        };
        let work = work as f64 * self.particles;
        let pace = ROOM * all * runner.elapsed() / work;
        let effort = asked.unwrap_or_else(|| Effort::within(phase.left() / pace, self.of));
        Ok(Chosen { effort, most: Some(pace * (self.of)(effort) as f64) })
    }
}

//! The predictability horizon of a scene for a displacement of 1e-8 m: the window.
//!
//! Two copies whose particles start so far away run beside the scene as it is. What that grows to is what the scene itself
//! leaves open, whatever the method; steps are far below the certified bound, so that it is not the method.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    math::Precision,
};

use super::effort::{Effort, OVERHEAD};
use crate::{
    case::{Case, Times},
    method::{Method, Setting, Steps},
    run::{End, Phase, Runner},
};

/// By how much copies are displaced (m).
pub const DISPLACEMENT: f64 = 1e-8;
/// Where their displacements come from.
pub const SEED: u64 = 42;
/// Copies that are displaced, each in its own way.
const COPIES: usize = 2;

/// Share of the tolerance within which spread and the reference's own error stay in a window.
pub(crate) const OPEN: f64 = 0.25;
/// Largest share of the certified bound that steps of reference runs have.
const SHARE: f64 = 0.45;
/// Shortest spacing of times, as a power of two that divides the time step of the scene.
const FINEST: u32 = 6;
/// Number of times from which on every other one is left out.
const MOST_TIMES: usize = 128;

/// The method of reference runs: order 2 with damping, and no solve that leaves anything over.
pub(crate) const REFERENCE: Setting = Setting::new(
    Method::new(Integrator::VelocityVerletPredicted, Hessian::Absolute),
    Precision::F64,
    Steps::Divided(0),
);

/// What the copies showed.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    /// Between times (s).
    pub spacing: f64,
    /// The spread (m) at each of them: the larger rms distance of a copy from the scene as it is.
    pub spread: Vec<f64>,
    /// Length of the steps (s).
    pub step: f64,
    /// The smallest certified bound on explicit steps (s) that was met; infinite where there is none.
    pub bound: f64,
    /// What happened to the copies, which also came to their end where the spread was above what is allowed; costly where a
    /// reference would take more work further on than its effort allows.
    pub end: End,
}

impl Scan {
    /// Of a case of which nothing was looked at.
    pub(crate) fn nothing(case: &Case) -> Self {
        let dt = case.dt();
        Self { spacing: dt, spread: Vec::new(), step: dt, bound: f64::INFINITY, end: End::Reached }
    }

    /// The times at which the spread, and that before it, is at most `allowed` (m).
    pub(crate) fn count_within(&self, allowed: f64) -> u64 {
        self.spread.iter().take_while(|spread| **spread <= allowed).count() as u64
    }

    /// The largest spread (m) until a time (s).
    pub fn largest_until(&self, end: f64) -> f64 {
        let count = (end / self.spacing).round() as usize;
        self.spread.iter().take(count).copied().fold(0.0, f64::max)
    }

    /// The seconds that it would have taken to a time (s), where it took so many until it was given up; infinite where it did
    /// not get far enough to tell.
    pub(crate) fn needed(&self, seconds: f64, end: f64) -> f64 {
        let reached = self.spacing * self.spread.len() as f64;
        if reached > 0.0 { seconds * end / reached } else { f64::INFINITY }
    }

    /// The mean rate (1/s) at which copies grow apart until a time (s), ln(spread / displacement) / time: the finite-time
    /// Lyapunov exponent. None where they were not looked at then.
    pub fn growth_rate(&self, end: f64) -> Option<f64> {
        let count = (end / self.spacing).round() as usize;
        let spread = *self.spread.get(count.checked_sub(1)?)?;
        (spread > 0.0).then(|| (spread / DISPLACEMENT).ln() / (self.spacing * count as f64))
    }
}

/// Runs copies of a case until a time (s), until their spread is above `allowed` (m), or as long as a reference of this effort can go
/// with them: for twice the evaluations that one of them takes. They are looked at once at least.
pub fn scan(case: &Case, end: f64, allowed: f64, effort: Option<Effort>, phase: &Phase) -> Scan {
    let spacing = shortest(case, end);
    let times = |spacing| Times::even(spacing, 1);
    let bound = match Runner::start(case, &REFERENCE, &times(spacing), phase) {
        Ok(runner) => runner.bound(),
        Err(failure) => {
            return Scan {
                spacing,
                spread: Vec::new(),
                step: spacing,
                bound: f64::INFINITY,
                end: End::Failed(failure),
            };
        }
    };
    let mut level = level_within(spacing, bound);
    let particles = case.particle_count() as u64 + OVERHEAD;
    let most = effort.map_or(u64::MAX, |effort| effort.of_cloth() / (2 * particles));
    let mut rng = fastrand::Rng::with_seed(SEED);
    let mut cases = vec![case.clone()];
    cases.extend((0..COPIES).map(|_| case.displaced(DISPLACEMENT, &mut rng)));
    loop {
        match Copies::start(&cases, spacing, level, phase)
            .and_then(|copies| copies.run(case, end, allowed, most))
        {
            Ok(scan) => return scan,
            Err(Stop::Shorter) => level += 1,
            Err(Stop::End(end)) => return Scan { spacing, spread: Vec::new(), step: spacing, bound, end },
        }
    }
}

/// How often a spacing (s) is halved until steps are short enough for a bound (s).
pub(super) fn level_within(spacing: f64, bound: f64) -> u32 {
    let mut level = 0;
    while spacing / f64::from(level).exp2() > SHARE * bound && level < 40 {
        level += 1;
    }
    level
}

/// The shortest spacing of times (s): a few of them lie within a step of the scene.
pub(super) fn shortest(case: &Case, end: f64) -> f64 {
    if case.has_moving_pins() {
        return case.dt();
    }
    let finest = case.dt() / f64::from(FINEST).exp2();
    let longest = end / MOST_TIMES as f64;
    let mut spacing = finest;
    while 2.0 * spacing <= longest.min(case.dt()) {
        spacing *= 2.0;
    }
    spacing
}

/// Why copies stop.
enum Stop {
    /// Their steps are too long for the bound as it has become.
    Shorter,
    End(End),
}

/// The scene as it is and its copies, on their way together.
struct Copies {
    runners: Vec<Runner>,
    spacing: f64,
    step: f64,
}

impl Copies {
    fn start(cases: &[Case], spacing: f64, level: u32, phase: &Phase) -> Result<Self, Stop> {
        let setting = Setting { steps: Steps::Divided(level), ..REFERENCE };
        let step = setting.dt(spacing).unwrap_or(spacing);
        let times = Times::even(spacing, 1);
        let runners = cases.iter().map(|case| Runner::start(case, &setting, &times, phase));
        let runners = runners.collect::<Result<Vec<_>, _>>();
        let runners = runners.map_err(|failure| Stop::End(End::Failed(failure)))?;
        Ok(Self { runners, spacing, step })
    }

    /// Until a time (s), a spread (m), or so many evaluations of the scene as it is.
    fn run(mut self, case: &Case, end: f64, allowed: f64, most: u64) -> Result<Scan, Stop> {
        let mut scan = Scan {
            spacing: self.spacing,
            spread: Vec::new(),
            step: self.step,
            bound: f64::INFINITY,
            end: End::Reached,
        };
        let count = (end / self.spacing + 1e-6) as u64;
        // Times are kept that are multiples of a power of two, which doubles when they are many.
        let mut stride = 1;
        for taken in 1..=count {
            if let Some(end) = self.runners.iter_mut().find_map(|runner| runner.advance().err()) {
                scan.end = end;
                break;
            }
            if taken % stride != 0 {
                continue;
            }
            scan.bound = scan.bound.min(self.runners[0].bound());
            if self.step > SHARE * scan.bound {
                return Err(Stop::Shorter);
            }
            let base = self.runners[0].positions();
            let distances = self.runners[1..].iter().map(|copy| case.rms(&base, &copy.positions()));
            let spread = distances.fold(0.0, f64::max);
            scan.spread.push(spread);
            if spread > allowed {
                break;
            }
            if taken < count && self.runners[0].work().force_evaluations > most {
                scan.end = End::Costly;
                break;
            }
            if scan.spread.len() >= MOST_TIMES {
                let mut place = 0;
                scan.spread.retain(|_| {
                    place += 1;
                    place % 2 == 0
                });
                stride *= 2;
            }
        }
        scan.spacing *= stride as f64;
        Ok(scan)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_growth_rate_is_that_of_an_exponential() {
        let spread = (1..=8).map(|i| DISPLACEMENT * (2.5 * 0.1 * f64::from(i)).exp()).collect();
        let scan = Scan { spacing: 0.1, spread, step: 1e-3, bound: f64::INFINITY, end: End::Reached };
        for end in [0.1, 0.4, 0.8] {
            let rate = scan.growth_rate(end).expect("a time that was looked at");
            assert!((rate - 2.5).abs() < 1e-12, "{rate} 1/s until {end} s");
        }
        assert_eq!([0.0, 0.9].map(|end| scan.growth_rate(end)), [None, None]);
    }
}

//! The predictability horizon of a scene for a displacement of 1e-8 m: the window.
//!
//! Two copies whose particles start so far away run beside the scene as it is. What that grows to is what the scene itself
//! leaves open, whatever the method; steps are far below the certified bound, so that it is not the method.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    math::Precision,
    report::Work,
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

/// How often steps of the scene are halved in the first reference run of bodies with a thickness.
const THICK_LEVEL: u32 = 2;

/// The method of reference runs of bodies with a thickness, which no other keeps apart: implicit Euler, whose steps divide those of
/// the scene and are checked. Solves leave nothing over that is seen beside what steps leave.
pub(crate) const THICK: Setting = Setting {
    solver_tolerance: 1e-8,
    ..Setting::new(
        Method::new(Integrator::ImplicitEuler, Hessian::Absolute),
        Precision::F64,
        Steps::Fixed(1 << THICK_LEVEL),
    )
};

/// How a reference run of a case is stepped whose longest steps are halved so often.
pub(super) fn at_level(case: &Case, level: u32) -> Setting {
    if case.is_thick() {
        Setting { steps: Steps::Fixed(1 << level), ..THICK }
    } else {
        Setting { steps: Steps::Divided(level), ..REFERENCE }
    }
}

/// The certified bound (s) on steps of a reference run as the scene is now; infinite for bodies with a thickness, whose steps are
/// implicit.
pub(super) fn certified(case: &Case, runner: &Runner) -> f64 {
    if case.is_thick() { f64::INFINITY } else { runner.bound() }
}

/// What counts as the work of a reference of cloth: evaluations of the force, and products where steps are implicit.
pub(crate) const fn counted(work: Work) -> u64 {
    work.force_evaluations + work.matrix_products
}

/// What the copies showed.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    /// Between times (s).
    pub spacing: f64,
    /// The spread (m) at each of them: the larger distance of a copy from the scene as it is, the rms of positions.
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

    /// The largest spread (m) at some times, each looked at on both sides; infinite where there was none.
    pub(crate) fn largest_at(&self, times: &Times) -> f64 {
        let last = self.spread.len().saturating_sub(1);
        let near = |mark: &u64| {
            // A time that is a multiple of the spacing but for rounding is one.
            let place = (times.time(*mark) / self.spacing * 1e6).round() / 1e6;
            let [before, after] = [place.floor(), place.ceil()].map(|place| (place as usize).max(1) - 1);
            // The end may lie between the last time that was looked at and the next.
            [before, after.min(before.max(last))]
        };
        let spread = |place: usize| self.spread.get(place).copied().unwrap_or(f64::INFINITY);
        times.marks.iter().flat_map(near).map(spread).fold(0.0, f64::max)
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
    let bound = match Runner::start(case, &at_level(case, 0), &times(spacing), phase) {
        Ok(runner) => certified(case, &runner),
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
    let mut level = first_level(case, spacing, bound);
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

/// How often a spacing (s) is halved until steps are short enough for a bound (s), or, without one, for a first run.
pub(super) fn first_level(case: &Case, spacing: f64, bound: f64) -> u32 {
    if case.is_thick() {
        return THICK_LEVEL;
    }
    let mut level = 0;
    while spacing / f64::from(level).exp2() > SHARE * bound && level < 40 {
        level += 1;
    }
    level
}

/// The shortest spacing of times (s): a few of them lie within a step of the scene, where its own steps are not needed.
pub(super) fn shortest(case: &Case, end: f64) -> f64 {
    if case.has_moving_pins() || case.is_thick() {
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
        let setting = at_level(&cases[0], level);
        // Of bodies with a thickness the spacing is the step of the scene, which is divided.
        let step = spacing / f64::from(level).exp2();
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
            scan.bound = scan.bound.min(certified(case, &self.runners[0]));
            if self.step > SHARE * scan.bound {
                return Err(Stop::Shorter);
            }
            let base = self.runners[0].observed(case);
            let distances = self.runners[1..].iter().map(|copy| case.distance(&base, &copy.observed(case)));
            let spread = distances.fold(0.0, f64::max);
            scan.spread.push(spread);
            if spread > allowed {
                break;
            }
            if taken < count && counted(self.runners[0].work()) > most {
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

    #[test]
    fn the_spread_at_a_time_is_that_around_it_alone() {
        let spread = vec![1e-6, 5e-3, 2e-6, 3e-6];
        let scan = Scan { spacing: 0.1, spread, step: 1e-3, bound: f64::INFINITY, end: End::Reached };
        let at = |interval: f64, marks: &[u64]| scan.largest_at(&Times { interval, marks: marks.to_vec() });
        assert_eq!([at(0.05, &[1]), at(0.05, &[7]), at(0.05, &[9])], [1e-6, 3e-6, 3e-6]);
        assert_eq!([at(0.05, &[3]), at(0.05, &[1, 5, 8])], [5e-3, 5e-3]);
        assert_eq!([at(0.05, &[10]), at(0.05, &[1, 20])], [f64::INFINITY; 2], "nothing is known there");
        assert_eq!(at(0.05, &[]), 0.0);
        assert!(Scan { spread: Vec::new(), ..scan }.largest_at(&Times::even(0.1, 1)).is_infinite());
    }
}

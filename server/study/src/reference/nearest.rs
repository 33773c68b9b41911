//! What is nearest to the truth: runs whose steps are halved again and again, extrapolated by the order that they show.

use nappe_sim::report::Work;

use super::{
    effort::{Effort, OVERHEAD},
    window::{at_level, counted},
};
use crate::{
    case::{Case, Times},
    method::Stepped,
    run::{End, Phase, Run, run},
};

/// How near to 1 or 2 the order must be that three runs show, for them to be extrapolated.
const NEAR: f64 = 0.2;
/// How often steps are halved, at most.
const HALVINGS: u32 = 14;
/// How many times as long a run takes as that of steps twice as long, with room for a busy machine.
const COST: f64 = 2.2;

/// The reference at some times.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Times that it was computed at.
    pub times: Times,
    /// What is compared at each time: positions (m), x y z per particle, or the number (m) that is measured.
    pub states: Vec<Vec<f64>>,
    /// Its own error (m) at each time: how far (rms) the last two extrapolations are apart, or the last two runs where
    /// these show no order.
    pub own_error: Vec<f64>,
    /// The order that runs show at each time; 0 where they show none that is of use.
    pub orders: Vec<f64>,
    /// How its last run was stepped.
    pub stepped: Stepped,
    /// The shortest steps (s), the mean of them where they vary.
    pub step: f64,
    /// What its runs cost.
    pub work: Work,
}

/// Why there is no reference.
#[derive(Clone, Debug, PartialEq)]
pub enum NoReference {
    /// Its time was over; about so many seconds would have been needed, infinite where that cannot be told.
    Time(f64),
    /// A step failed.
    Failed(String),
}

impl NoReference {
    /// The same where so many seconds went before.
    pub(crate) fn after(self, seconds: f64) -> Self {
        match self {
            Self::Time(needed) => Self::Time(seconds + needed),
            Self::Failed(cause) => Self::Failed(cause),
        }
    }
}

impl Reference {
    /// The same at the first times alone, of which only multiples of a power of two are kept.
    pub(crate) fn kept(&self, count: u64, stride: u64) -> Self {
        let (coarse, places) = self.times.coarser(self.times.interval * stride as f64);
        let kept = coarse.marks.iter().take_while(|mark| **mark * stride <= count).count();
        let (times, places) = (Times { marks: coarse.marks[..kept].to_vec(), ..coarse }, &places[..kept]);
        Self {
            times,
            states: places.iter().map(|i| self.states[*i].clone()).collect(),
            own_error: places.iter().map(|i| self.own_error[*i]).collect(),
            orders: places.iter().map(|i| self.orders[*i]).collect(),
            ..*self
        }
    }

    /// Its largest own error (m).
    pub fn error(&self) -> f64 {
        self.own_error.iter().copied().fold(0.0, f64::max)
    }
}

/// Halves steps, which begin at most `step` (s) long, until the own error is below `wanted` (m) at all times, or the next run
/// would take more work than the effort allows. Two runs are made in any case. A reference is the same whatever time there is for it, or
/// there is none. Of bodies with a thickness times are multiples of the scene's time step, which their steps divide.
///
/// # Errors
/// When a step failed, or time was over before that.
pub fn reference(
    case: &Case,
    times: &Times,
    step: f64,
    wanted: f64,
    effort: Effort,
    phase: &Phase,
) -> Result<Reference, NoReference> {
    let longest = if case.is_thick() { case.dt() } else { times.interval };
    let mut level = 0;
    while longest / f64::from(level).exp2() > step * (1.0 + 1e-9) {
        level += 1;
    }

    let mut ladder = Ladder { case, runs: Vec::new(), extrapolated: Vec::new(), distances: Vec::new() };
    let mut found: Option<Reference> = None;
    let mut work = Work::default();
    let [mut seconds, mut all] = [0.0; 2];
    for _ in 0..HALVINGS {
        let setting = at_level(case, level);
        if !setting.fits(case, times.interval) {
            break;
        }
        let needed = |error: Option<f64>| all + seconds * runs(error, wanted);
        let error = found.as_ref().map(Reference::error);
        if COST * seconds > phase.left() {
            return Err(NoReference::Time(needed(error)));
        }
        let made = run(case, &setting, times, phase);
        match made.end {
            End::Reached => {}
            End::Failed(failure) => return Err(NoReference::Failed(failure.cause)),
            End::Cut(_) | End::Costly if seconds > 0.0 => return Err(NoReference::Time(needed(error))),
            End::Cut(_) | End::Costly => {
                return Err(NoReference::Time(whole(&made, times.end()) * (1.0 + runs(None, wanted))));
            }
        }
        seconds = made.seconds.iter().sum();
        all += seconds;
        work = work.and(made.work);
        level += 1;
        let Some((states, own_error, orders)) = ladder.add(made.states) else { continue };
        let stepped = (&setting).into();
        let orders = orders.into_iter().map(f64::from).collect();
        let (times, step) = (times.clone(), made.dt);
        let new = Reference { times, states, own_error, orders, stepped, step, work };
        let next = 2 * counted(made.work) * (case.particle_count() as u64 + OVERHEAD);
        let is_last = new.error() < wanted || next > effort.of_cloth();
        found = Some(new);
        if is_last {
            break;
        }
    }
    found.ok_or_else(|| {
        NoReference::Failed(
            "where pins move, a step of the scene has no room for steps that are short enough".to_owned(),
        )
    })
}

/// How many times as long all further runs take as the last one, whose error (m) is to come down to another (m): an error
/// falls by order 2, and one that is not known yet takes three.
fn runs(error: Option<f64>, wanted: f64) -> f64 {
    let halvings =
        error.map_or(3.0, |error| (0.5 * (error / wanted).log2()).ceil().clamp(1.0, f64::from(HALVINGS)));
    2.0 * (halvings.exp2() - 1.0)
}

/// The seconds that a run would have taken to an end (s), of one that was given up.
fn whole(made: &Run, end: f64) -> f64 {
    if made.tried > 0.0 { made.elapsed * end / made.tried } else { f64::INFINITY }
}

/// What is compared at each time.
type States = Vec<Vec<f64>>;

/// Runs, each with steps half as long as those of the one before; the last of them.
struct Ladder<'a> {
    case: &'a Case,
    runs: States,
    /// The extrapolation at each time, with its order.
    extrapolated: Vec<Option<(u32, Vec<f64>)>>,
    /// How far (rms, m) the last two runs were apart at each time.
    distances: Vec<f64>,
}

impl Ladder<'_> {
    /// Adds a run; the best states, their own errors and orders, from the second one on.
    fn add(&mut self, run: States) -> Option<(States, Vec<f64>, Vec<u32>)> {
        if self.runs.is_empty() {
            self.runs = run;
            return None;
        }
        let before = std::mem::replace(&mut self.runs, run);
        let distances: Vec<f64> =
            before.iter().zip(&self.runs).map(|(a, b)| self.case.distance(a, b)).collect();
        let old = std::mem::replace(&mut self.distances, distances);
        let (mut states, mut errors, mut orders) = (Vec::new(), Vec::new(), Vec::new());
        let mut extrapolated = Vec::new();
        for (i, (coarse, fine)) in before.iter().zip(&self.runs).enumerate() {
            let order = old.get(i).and_then(|old| order(*old, self.distances[i]));
            let new = order.map(|order| (order, extrapolate(coarse, fine, order)));
            let last = self.extrapolated.get(i).and_then(Option::as_ref);
            let (state, error) = match (&new, last) {
                (Some((order, new)), Some((same, last))) if order == same => {
                    (new, self.case.distance(new, last))
                }
                (Some((_, new)), _) => (new, self.distances[i]),
                // The least order that would have been taken for 1.
                (None, _) => (fine, self.distances[i] / ((1.0 - NEAR).exp2() - 1.0)),
            };
            states.push(state.clone());
            errors.push(error);
            orders.push(order.unwrap_or(0));
            extrapolated.push(new);
        }
        self.extrapolated = extrapolated;
        Some((states, errors, orders))
    }
}

/// The order that two successive distances of runs show, if it is 1 or 2.
fn order(old: f64, new: f64) -> Option<u32> {
    let seen = (old / new).log2();
    [1, 2].into_iter().find(|order| (seen - f64::from(*order)).abs() < NEAR)
}

fn extrapolate(coarse: &[f64], fine: &[f64], order: u32) -> Vec<f64> {
    let share = 1.0 / (f64::from(order).exp2() - 1.0);
    coarse.iter().zip(fine).map(|(coarse, fine)| fine + (fine - coarse) * share).collect()
}

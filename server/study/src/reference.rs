//! What is nearest to the truth: runs whose steps are halved again and again, extrapolated by the order that they show.

use nappe_sim::report::Work;

use crate::{
    budget::Phase,
    case::Case,
    run::{End, run},
    setting::{Setting, Steps},
    stepped::Stepped,
    times::Times,
    window::REFERENCE,
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
    /// Positions (m), x y z per particle, at each time.
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
    /// Whether its time was over before its error was as small as wanted.
    pub is_cut: bool,
}

/// No two runs of a reference were made.
#[derive(Clone, Debug, PartialEq)]
pub enum NoReference {
    /// Their time was over; so many seconds would have been needed for two.
    Time(f64),
    /// A step failed.
    Failed(String),
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

/// Halves steps, which begin at most `step` (s) long, until the own error is below `wanted` (m) at all times or a phase is
/// over.
///
/// # Errors
/// When not even two runs could be made.
pub fn reference(
    case: &Case,
    times: &Times,
    step: f64,
    wanted: f64,
    phase: &Phase,
) -> Result<Reference, NoReference> {
    let mut level = 0;
    while times.interval / f64::from(level).exp2() > step * (1.0 + 1e-9) {
        level += 1;
    }

    let mut ladder = Ladder { case, runs: Vec::new(), extrapolated: Vec::new(), distances: Vec::new() };
    let mut found: Option<Reference> = None;
    let mut work = Work::default();
    let mut seconds = 0.0;
    for _ in 0..HALVINGS {
        let setting = Setting { steps: Steps::Divided(level), ..REFERENCE };
        let is_late = phase.is_over() || COST * seconds > phase.left();
        if is_late || !setting.fits(case, times.interval) {
            break;
        }
        let made = run(case, &setting, times, phase);
        match made.end {
            End::Reached => {}
            End::Stopped => break,
            End::Failed(failure) => return Err(NoReference::Failed(failure.cause)),
        }
        seconds = made.seconds.iter().sum();
        work = work.and(made.work);
        level += 1;
        if let Some((states, own_error, orders)) = ladder.add(made.states) {
            let is_cut = false;
            let stepped = (&setting).into();
            let orders = orders.into_iter().map(f64::from).collect();
            let (times, step) = (times.clone(), made.dt);
            let new = Reference { times, states, own_error, orders, stepped, step, work, is_cut };
            let is_good = new.error() < wanted;
            found = Some(new);
            if is_good {
                return found.ok_or(NoReference::Time(0.0));
            }
        }
    }
    found.map(|found| Reference { is_cut: true, ..found }).ok_or(NoReference::Time((1.0 + COST) * seconds))
}

/// Positions at each time.
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
        let distances: Vec<f64> = before.iter().zip(&self.runs).map(|(a, b)| self.case.rms(a, b)).collect();
        let old = std::mem::replace(&mut self.distances, distances);
        let (mut states, mut errors, mut orders) = (Vec::new(), Vec::new(), Vec::new());
        let mut extrapolated = Vec::new();
        for (i, (coarse, fine)) in before.iter().zip(&self.runs).enumerate() {
            let order = old.get(i).and_then(|old| order(*old, self.distances[i]));
            let new = order.map(|order| (order, extrapolate(coarse, fine, order)));
            let last = self.extrapolated.get(i).and_then(Option::as_ref);
            let (state, error) = match (&new, last) {
                (Some((order, new)), Some((same, last))) if order == same => (new, self.case.rms(new, last)),
                (Some((_, new)), _) => (new, self.distances[i]),
                (None, _) => (fine, self.distances[i]),
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

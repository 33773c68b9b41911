//! References of snow: the scene as it is written on cells that are halved again and again, each particle split
//! into eight, with the ratio of steps to cells kept.
//!
//! Halving steps alone converges to nothing: a share of PIC, the filter of APIC and MLS, and floors act once per step.

use nappe_sim::{math::Precision, report::Work, snow::SnowSetup};

use super::{
    effort::Effort,
    nearest::{NoReference, Reference},
};
use crate::{
    case::{Case, Times},
    method::{CHILDREN, SnowSetting},
    run::{End, Phase, Run, run},
};

/// How often cells are halved, at most: particles are 512 times as many then.
const HALVINGS: u32 = 3;
/// How many times as much work a run takes whose cells are half as long: 8 times as many particles make twice as many steps.
pub(crate) const COST: f64 = 16.0;
/// How many times as long a run takes in f64.
pub(crate) const F64_COST: f64 = 2.5;
/// Orders by which the error of a run follows from its distance to the one before.
const ORDERS: std::ops::RangeInclusive<f64> = 0.7..=2.3;
/// How far (m) f32 is from f64 on snow, and the times of it from which on f32 is good enough for a reference.
const F32_ERROR: f64 = 2e-5;
const FAR: f64 = 5.0;

/// The reference of the snow of a case, in f32, or in f64 where its own error comes near that of f32 and that takes no more work
/// than is allowed. Its times end where a step of the first halving failed.
///
/// # Errors
/// When time was over, or a step failed before the first time.
pub(crate) fn halved(
    case: &Case,
    times: &Times,
    effort: Effort,
    phase: &Phase,
) -> Result<Reference, NoReference> {
    let Some(snow) = &case.setup.snow else {
        return Err(NoReference::Failed("there is no snow".to_owned()));
    };
    let most = effort.of_snow() as f64;
    let (mut found, work) = Ladder::new((case, snow), Precision::F32, most).climb(times, phase)?;
    let is_near = found.error() < FAR * F32_ERROR;
    if is_near && F64_COST * work <= most {
        match Ladder::new((case, snow), Precision::F64, most).climb(&found.times, phase) {
            Ok((finer, _)) if finer.times == found.times => {
                return Ok(Reference { work: found.work.and(finer.work), ..finer });
            }
            Err(NoReference::Time(seconds)) => return Err(NoReference::Time(seconds)),
            Ok(_) | Err(NoReference::Failed(_)) => {}
        }
    }
    found.own_error.iter_mut().for_each(|error| *error = error.max(F32_ERROR));
    Ok(found)
}

/// Runs, each on cells half as long as those of the one before.
struct Ladder<'a> {
    case: &'a Case,
    snow: &'a SnowSetup,
    precision: Precision,
    /// Steps of particles that a run takes at most, beyond which cells are not halved again.
    most: f64,
    /// Positions of the last run at each time.
    states: Vec<Vec<f64>>,
    /// How far (rms, m) each run is from the one before, at each time.
    distances: Vec<Vec<f64>>,
    work: Work,
}

impl<'a> Ladder<'a> {
    fn new((case, snow): (&'a Case, &'a SnowSetup), precision: Precision, most: f64) -> Self {
        let (states, distances) = (Vec::new(), Vec::new());
        Self { case, snow, precision, most, states, distances, work: Work::default() }
    }

    /// Halves cells as often as the work is allowed, once at least; the reference, and the steps of particles of its last run.
    fn climb(mut self, times: &Times, phase: &Phase) -> Result<(Reference, f64), NoReference> {
        let mut times = times.clone();
        let first = self.run(0, &times, phase);
        if first.end != End::Reached {
            return Err(missing(&first, times.end(), 1.0 + COST));
        }
        let mut steps = self.steps(&first, 0);
        self.states = first.states;
        let mut last = (SnowSetting::own(self.snow, self.precision, 0), first.dt);
        for halving in 1..=HALVINGS {
            if halving > 1 && COST * steps > self.most {
                break;
            }
            let made = self.run(halving, &times, phase);
            let has_failed = matches!(made.end, End::Failed(_));
            if made.states.is_empty() || (made.end != End::Reached && !has_failed) {
                return Err(missing(&made, times.end(), 1.0));
            }
            if has_failed && halving > 1 {
                break;
            }
            steps = self.steps(&made, halving);
            times.marks.truncate(made.states.len());
            self.states.truncate(made.states.len());
            let pairs = self.states.iter().zip(&made.states);
            self.distances.push(pairs.map(|(coarse, fine)| self.case.distance(coarse, fine)).collect());
            last = (SnowSetting::own(self.snow, self.precision, halving), made.dt);
            self.states = made.states;
            if has_failed {
                break;
            }
        }
        let (own_error, orders) = (0..times.marks.len()).map(|place| self.own_error(place)).unzip();
        let stepped = (&last.0).into();
        let (states, work, step) = (self.states, self.work, last.1);
        Ok((Reference { times, states, own_error, orders, stepped, step, work }, steps))
    }

    /// Steps of particles that a run took.
    fn steps(&self, made: &Run, halvings: u32) -> f64 {
        let particles = self.case.particle_count() as f64 * (CHILDREN as f64).powi(halvings as i32);
        made.work.force_evaluations as f64 * particles
    }

    fn run(&mut self, halvings: u32, times: &Times, phase: &Phase) -> Run {
        let setting = SnowSetting::own(self.snow, self.precision, halvings);
        let made = run(self.case, &setting, times, phase);
        self.work = self.work.and(made.work);
        made
    }

    /// How far (m) the last run is from the truth at a time, and the order that tells so: from its distance to the run before
    /// by the order that the last three show, or by the least that is of use where they show none.
    fn own_error(&self, place: usize) -> (f64, f64) {
        let mut distances = self.distances.iter().rev().map(|distances| distances[place]);
        let last = distances.next().unwrap_or(f64::INFINITY);
        let order = distances.next().map(|before| (before / last).log2());
        match order.filter(|order| ORDERS.contains(order)) {
            Some(order) => (last / (order.exp2() - 1.0), order),
            None => (last / (ORDERS.start().exp2() - 1.0), 0.0),
        }
    }
}

/// Why there is no reference: a run did not reach an end (s). All of them would take so many times as long as it.
fn missing(made: &Run, end: f64, ratio: f64) -> NoReference {
    if let End::Failed(failure) = &made.end {
        return NoReference::Failed(failure.cause.clone());
    }
    let whole = if made.tried > 0.0 { made.elapsed * end / made.tried } else { f64::INFINITY };
    NoReference::Time(whole * ratio)
}

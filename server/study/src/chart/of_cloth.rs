//! The chart of a scene of cloth: its window, a reference within it, and rows of every method against it.

use std::time::Instant;

use super::{front, request::Request, row::Row, rows::rows, timing};
use crate::{
    case::{Case, Measure, Times},
    method::Stepped,
    quantity::moment,
    reference::{Chosen, Effort, NoReference, OPEN, Reference, Scan, chosen, reference, scan},
    run::{Budget, End, Phase},
};

/// Shares of the budget at whose end each part is over: the reference is known then, or nothing is.
pub(crate) const REFERENCE: f64 = 0.7;
const ROWS: f64 = 0.85;
const AGAIN: f64 = 0.98;

/// Share of the tolerance that the reference is to be good to.
const GOOD_REFERENCE: f64 = 1e-4;

/// Where the reference is known to a quarter of the tolerance at fewer times than these, a chart compares at all of its times.
const TIMES: u64 = 16;
/// How many times what fits into a budget may take as long as it looks.
const ROOM: f64 = 1.5;

/// What ends the time in which runs are compared.
#[derive(Clone, Debug, PartialEq)]
pub enum Limit {
    /// It was asked for.
    Asked,
    /// The scene ends.
    Scene,
    /// Runs that start almost alike drift apart.
    Spread,
    /// The reference is not good enough further on.
    Reference,
    /// A reference would take more work further on than its effort allows.
    Work,
    /// A step of a reference run failed.
    Failed(String),
}

/// The chart of a scene.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What is compared.
    pub measure: Measure,
    /// When the scene ends (s), whatever is compared of it; that which was asked for where it has no end.
    pub end: f64,
    /// Error that matters (m).
    pub tolerance: f64,
    /// The class of effort of the reference; none where it came to none.
    pub effort: Option<Effort>,
    /// What copies showed that start a hair away.
    pub scan: Scan,
    /// The reference at all times that were looked at.
    pub whole: Option<Reference>,
    /// Why there is none.
    pub missing: Option<NoReference>,
    /// The time (s), a step of the scene, until which runs could be compared within the budget, where the times that are asked for take
    /// longer.
    pub fits: Option<f64>,
    /// The reference at the comparison times.
    pub reference: Option<Reference>,
    /// What ends them.
    pub limit: Limit,
    /// What errors can be told from nothing (m).
    pub floor: f64,
    /// Rows, in the order of methods, precisions and steps.
    pub rows: Vec<Row>,
    /// Those of a coarser copy; none where it was not looked at.
    pub coarser: Option<CoarserRows>,
    /// Whether anything was left out for want of time.
    pub is_cut: bool,
    /// Whether somebody ended it.
    pub is_stopped: bool,
}

/// Rows of a coarser copy of the scene of a chart: compared with its reference at the points that both have in common.
#[derive(Clone, Debug)]
pub struct CoarserRows {
    /// What the copy is called.
    pub name: String,
    /// The cheapest first.
    pub rows: Vec<Row>,
}

/// Times at which a reference is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kept {
    /// 16 to 31.
    Few,
    /// Every step of the scene.
    EveryStep,
}

/// Coordinates of a reference at every step of a scene, at most (256 MiB); of more only every second, fourth, ... step is kept.
const MOST_COORDINATES: u64 = 1 << 25;

impl Chart {
    /// Without a reference and rows yet.
    pub(super) fn new(case: &Case, request: &Request, limit: Limit, scan: Scan) -> Self {
        let asked = request.times.as_ref().map_or(request.end, |times| request.end.max(times.end()));
        Self {
            measure: case.measure().clone(),
            end: if request.scene_steps == 0 { asked } else { request.scene_steps as f64 * case.dt() },
            tolerance: request.tolerance,
            effort: None,
            scan,
            whole: None,
            missing: None,
            fits: None,
            reference: None,
            limit,
            floor: 0.0,
            rows: Vec::new(),
            coarser: None,
            is_cut: false,
            is_stopped: false,
        }
    }

    /// The last comparison time (s); 0 without any.
    pub fn until(&self) -> f64 {
        self.reference.as_ref().map_or(0.0, |reference| reference.times.end())
    }

    /// Whether that is the end of the scene. A window that ends with it may leave out what is less than one of its intervals.
    pub fn is_whole(&self) -> bool {
        let share = if self.limit == Limit::Scene { 0.9 } else { 1.0 - 1e-9 };
        self.until() >= share * self.end
    }

    /// What was compared and for how long, as it stands in a sentence: `until 0.120 s of 6.000 s`, `at the end, 6.000 s`.
    pub fn compared(&self) -> String {
        let until = moment(self.until());
        let of = if self.is_whole() { String::new() } else { format!(" of {}", moment(self.end)) };
        match &self.measure {
            Measure::Motion => format!("until {until}{of}"),
            Measure::End if of.is_empty() => format!("at the end, {until}"),
            Measure::End => format!("at {until}{of}"),
            measure => format!("in {} until {until}{of}", measure.words()),
        }
    }

    /// The mean rate (1/s) at which copies grow apart until then; none of snow, and of what is not the motion.
    pub fn growth_rate(&self) -> Option<f64> {
        let is_motion = self.measure == Measure::Motion;
        self.scan.growth_rate(self.until()).filter(|_| is_motion)
    }

    /// The finest row of an implicit method: how near another family comes to the reference. None where that is implicit too.
    pub fn other_family(&self) -> Option<&Row> {
        let is_implicit = |stepped: Stepped| match stepped {
            Stepped::Cloth(setting) => setting.method.integrator.is_implicit(),
            Stepped::Snow(_) => false,
        };
        if self.reference.as_ref().is_some_and(|reference| is_implicit(reference.stepped)) {
            return None;
        }
        let implicit = self.rows.iter().filter(|row| !row.own && is_implicit(row.stepped));
        let held = implicit.filter_map(|row| Some((row.error()?, row)));
        held.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, row)| row)
    }
}

/// Charts the cloths of a case. `tell` is called with what is done now.
pub(crate) fn of_cloth(case: &Case, request: &Request, budget: &Budget, tell: &dyn Fn(&str)) -> Chart {
    let mut chart = without_rows(case, request, Kept::Few, budget, tell);
    if let Some(reference) = chart.reference.clone() {
        let (rows, is_cut) = rows(case, request, &reference, chart.floor, &budget.until(ROWS), tell);
        chart.rows = rows;
        chart.is_cut |= is_cut;
        front::mark(&mut chart.rows, chart.floor);
        tell("timing the best rows again, in turn");
        timing::again(case, &mut chart.rows, &reference.times, &budget.until(AGAIN));
        front::mark(&mut chart.rows, chart.floor);
    }
    chart.is_stopped = budget.is_stopped();
    chart
}

/// The window of the cloths of a case and the reference within it: a chart on which no run is yet.
pub(crate) fn without_rows(
    case: &Case,
    request: &Request,
    kept: Kept,
    budget: &Budget,
    tell: &dyn Fn(&str),
) -> Chart {
    let phase = budget.until(REFERENCE);
    let left = phase.left();
    let mut chart = compared(case, request, kept, &phase, tell);
    chart.is_cut = matches!(chart.missing, Some(NoReference::Time(_)));
    chart.fits = chart.missing.as_ref().and_then(|missing| fits(case, request, missing, left));
    chart
}

/// Chooses a class of effort, looks for the window, and for the reference within it.
fn compared(case: &Case, request: &Request, kept: Kept, phase: &Phase, tell: &dyn Fn(&str)) -> Chart {
    tell("measuring the first steps");
    let asked = request.times.as_ref().map(Times::end);
    let ends = [asked.unwrap_or(request.end), asked.unwrap_or(0.0)];
    let chosen = match chosen(case, request.effort, ends, phase) {
        Ok(chosen) => chosen,
        Err(missing) => {
            let chart = Chart::new(case, request, Limit::Scene, Scan::nothing(case));
            return Chart { effort: request.effort, missing: Some(missing), ..chart };
        }
    };
    let begin = Instant::now();
    let chart = horizon(case, request, &chosen, phase, tell);
    if chart.missing.is_some() {
        return chart;
    }
    let seconds = begin.elapsed().as_secs_f64();
    let mut chart = referred(chart, case, request, (kept, &chosen), phase, tell);
    chart.missing = chart.missing.map(|missing| missing.after(seconds));
    chart
}

/// The predictability horizon alone, by copies that start a hair away. Where times are asked for they go on to the last of them.
fn horizon(case: &Case, request: &Request, chosen: &Chosen, phase: &Phase, tell: &dyn Fn(&str)) -> Chart {
    let (end, most, effort) = match &request.times {
        Some(times) => (times.end(), f64::INFINITY, None),
        None => (request.end, OPEN * request.tolerance, Some(chosen.effort)),
    };
    tell(&chosen.told("looking for the predictability horizon"));
    let begin = Instant::now();
    let scan = scan(case, end, most, effort, phase);
    let seconds = begin.elapsed().as_secs_f64();
    let mut chart = Chart::new(case, request, limit(&scan, request), scan);
    chart.effort = Some(chosen.effort);
    if chart.scan.end.cut().is_some() {
        // The scan has three copies of the scene; the reference takes longer.
        chart.missing = Some(NoReference::Time(2.0 * chart.scan.needed(seconds, end)));
    }
    chart
}

/// The same with the reference within it.
fn referred(
    mut chart: Chart,
    case: &Case,
    request: &Request,
    (kept, chosen): (Kept, &Chosen),
    phase: &Phase,
    tell: &dyn Fn(&str),
) -> Chart {
    let allowed = OPEN * request.tolerance;
    let within = Times::even(chart.scan.spacing, chart.scan.count_within(allowed));
    let every_step = |end: f64| {
        let most = MOST_COORDINATES / (3 * case.particle_count().max(1)) as u64;
        Times::every_step(end, case.dt(), most)
    };
    let times = match (&request.times, kept) {
        (Some(times), Kept::EveryStep) if !case.measure().is_of_positions() => every_step(times.end()),
        (Some(times), Kept::EveryStep) => times.in_steps(case.dt()),
        (Some(times), Kept::Few) => times.clone(),
        (None, Kept::Few) => within,
        (None, Kept::EveryStep) => every_step(within.end()),
    };
    if times.count() > 0 {
        tell(&chosen.told("computing the reference"));
        let wanted = GOOD_REFERENCE * request.tolerance;
        match reference(case, &times, chart.scan.step, wanted, chosen.effort, phase) {
            Ok(found) => chart.keep(found, request, kept),
            Err(missing) => chart.missing = Some(missing),
        }
    }
    chart
}

/// The time (s), a step of the scene, until which runs could be compared in some seconds, where the times that are asked for take so many
/// more.
pub(super) fn fits(case: &Case, request: &Request, missing: &NoReference, seconds: f64) -> Option<f64> {
    let (Some(times), NoReference::Time(needed)) = (&request.times, missing) else { return None };
    let steps = (times.end() * (seconds / (ROOM * needed)).min(1.0) / case.dt()).floor();
    // In as few digits as tell it apart.
    let until = (steps * case.dt() * 1e9).round() / 1e9;
    (steps >= 1.0 && until < times.end()).then_some(until)
}

fn limit(scan: &Scan, request: &Request) -> Limit {
    match &scan.end {
        _ if request.times.is_some() => Limit::Asked,
        End::Failed(failure) => Limit::Failed(failure.cause.clone()),
        End::Reached if scan.spread.last().is_some_and(|spread| *spread > OPEN * request.tolerance) => {
            Limit::Spread
        }
        End::Costly => Limit::Work,
        // Where its time was over nothing is compared.
        End::Reached | End::Cut(_) => Limit::Scene,
    }
}

impl Chart {
    /// Takes a reference over, and of its times those that runs are compared at.
    fn keep(&mut self, found: Reference, request: &Request, kept: Kept) {
        let known = if request.times.is_some() {
            found.clone()
        } else {
            let is_within = |error: &&f64| **error <= OPEN * self.tolerance;
            let good = found.own_error.iter().take_while(is_within).count() as u64;
            // Where hardly anything is known so well, a chart tells errors that are larger than that of the reference.
            let is_rough = kept == Kept::Few && good < TIMES;
            let count = if is_rough { found.times.count() } else { good };
            if count < found.times.count() {
                self.limit = Limit::Reference;
            }
            let stride = match kept {
                Kept::Few => 1 << (count / 16).max(1).ilog2(),
                Kept::EveryStep => 1,
            };
            found.kept(count, stride)
        };
        let error = known.error();
        // Within a window copies stay within a quarter of the tolerance; at times that were asked for they may not.
        self.floor = match (&request.times, &self.measure) {
            (None, _) => error,
            (Some(_), Measure::Motion) => error.max(self.scan.largest_until(known.times.end())),
            // What comes to rest may be known again after its way there is not.
            (Some(_), _) => error.max(self.scan.largest_at(&known.times)),
        };
        // A plan promises nothing that is not known.
        let is_promised = kept == Kept::EveryStep && self.measure != Measure::Motion;
        let is_known = !is_promised || self.floor <= OPEN * self.tolerance;
        self.reference = (known.times.count() > 0 && is_known).then_some(known);
        self.whole = Some(found);
    }
}

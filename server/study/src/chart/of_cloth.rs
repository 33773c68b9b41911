//! The chart of a scene of cloth: its window, a reference within it, and rows of every method against it.

use std::time::Instant;

use super::{front, request::Request, row::Row, rows::rows, timing};
use crate::{
    case::{Case, Times},
    method::Stepped,
    reference::{NoReference, OPEN, Reference, Scan, reference, scan},
    run::{Budget, End},
};

/// Shares of the budget at whose end each part is over: the reference is known then, or nothing is.
pub(crate) const REFERENCE: f64 = 0.7;
const ROWS: f64 = 0.85;
const AGAIN: f64 = 0.98;

/// Share of the tolerance that the reference is to be good to.
const GOOD_REFERENCE: f64 = 1e-4;

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
    /// A reference would take too much work further on.
    Work,
    /// A step of a reference run failed.
    Failed(String),
}

/// The chart of a scene.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Error that matters (m).
    pub tolerance: f64,
    /// What copies showed that start a hair away.
    pub scan: Scan,
    /// The reference at all times that were looked at.
    pub whole: Option<Reference>,
    /// Why there is none.
    pub missing: Option<NoReference>,
    /// The reference at the comparison times.
    pub reference: Option<Reference>,
    /// What ends them.
    pub limit: Limit,
    /// What errors can be told from nothing (m).
    pub floor: f64,
    /// Rows, in the order of methods, precisions and steps.
    pub rows: Vec<Row>,
    /// Whether anything was left out for want of time.
    pub is_cut: bool,
    /// Whether somebody ended it.
    pub is_stopped: bool,
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
    /// Without a reference and rows yet, to a tolerance (m).
    pub(super) fn new(tolerance: f64, limit: Limit, scan: Scan) -> Self {
        Self {
            tolerance,
            scan,
            whole: None,
            missing: None,
            reference: None,
            limit,
            floor: 0.0,
            rows: Vec::new(),
            is_cut: false,
            is_stopped: false,
        }
    }

    /// The last comparison time (s); 0 without any.
    pub fn until(&self) -> f64 {
        self.reference.as_ref().map_or(0.0, |reference| reference.times.end())
    }

    /// The mean rate (1/s) at which copies grow apart until then; none of snow.
    pub fn growth_rate(&self) -> Option<f64> {
        self.scan.growth_rate(self.until())
    }

    /// The finest row of an implicit method: how near another family comes to the reference.
    pub fn other_family(&self) -> Option<&Row> {
        let is_implicit = |row: &&Row| match row.stepped {
            Stepped::Cloth(setting) => setting.method.integrator.is_implicit(),
            Stepped::Snow(_) => false,
        };
        let implicit = self.rows.iter().filter(|row| !row.own).filter(is_implicit);
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
        front::mark(&mut chart.rows);
        tell("timing the best rows again, in turn");
        timing::again(case, &mut chart.rows, &reference.times, &budget.until(AGAIN));
        front::mark(&mut chart.rows);
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
    let allowed = OPEN * request.tolerance;
    let end = request.times.as_ref().map_or(request.end, Times::end);
    let most = if request.times.is_some() { f64::INFINITY } else { allowed };
    tell("looking for the predictability horizon");
    let phase = budget.until(REFERENCE);
    let begin = Instant::now();
    let scan = scan(case, end, most, &phase);
    let seconds = begin.elapsed().as_secs_f64();
    let mut chart = Chart::new(request.tolerance, limit(&scan, request), scan);
    if chart.scan.end.cut().is_some() {
        chart.is_cut = true;
        // The scan has three copies of the scene; the reference takes longer.
        chart.missing = Some(NoReference::Time(2.0 * chart.scan.needed(seconds, end)));
        return chart;
    }

    let within = Times::even(chart.scan.spacing, chart.scan.count_within(allowed));
    let times = match (&request.times, kept) {
        (Some(times), _) => times.clone(),
        (None, Kept::Few) => within,
        (None, Kept::EveryStep) => {
            let most = MOST_COORDINATES / (3 * case.particle_count().max(1)) as u64;
            Times::every_step(within.end(), case.dt(), most)
        }
    };
    if times.count() > 0 {
        tell("computing the reference");
        let wanted = GOOD_REFERENCE * request.tolerance;
        match reference(case, &times, chart.scan.step, wanted, &phase) {
            Ok(found) => chart.keep(found, request, kept),
            Err(missing) => {
                chart.is_cut = matches!(missing, NoReference::Time(_));
                chart.missing = Some(missing.after(seconds));
            }
        }
    }
    chart
}

fn limit(scan: &Scan, request: &Request) -> Limit {
    match &scan.end {
        _ if request.times.is_some() => Limit::Asked,
        End::Failed(failure) => Limit::Failed(failure.cause.clone()),
        End::Reached if scan.spread.last().is_some_and(|spread| *spread > OPEN * request.tolerance) => {
            Limit::Spread
        }
        // Where its time was over nothing is compared.
        End::Reached | End::Cut(_) | End::Costly => Limit::Scene,
    }
}

impl Chart {
    /// Takes a reference over, and of its times those that runs are compared at.
    fn keep(&mut self, found: Reference, request: &Request, kept: Kept) {
        let kept = if request.times.is_some() {
            found.clone()
        } else {
            let is_within = |error: &&f64| **error <= OPEN * self.tolerance;
            let count = found.own_error.iter().take_while(is_within).count() as u64;
            if count < found.times.count() {
                self.limit = Limit::Reference;
            }
            let stride = match kept {
                Kept::Few => 1 << (count / 16).max(1).ilog2(),
                Kept::EveryStep => 1,
            };
            found.kept(count, stride)
        };
        let error = kept.error();
        // Within a window copies stay within a quarter of the tolerance; at times that were asked for they may not.
        self.floor = match request.times {
            Some(_) => error.max(self.scan.largest_until(kept.times.end())),
            None => error,
        };
        self.reference = (kept.times.count() > 0).then_some(kept);
        self.whole = Some(found);
    }
}

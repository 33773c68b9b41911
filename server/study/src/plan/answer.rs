//! A plan: what is recommended, what was tried, and what it would take where nothing is right enough.

use nappe_sim::math::Precision;

use super::{
    candidate::{Candidate, Dropped},
    search::{RIGHT, Search},
    terms::{Term, terms},
    verify::{Verified, verified},
};
use crate::{
    budget::{Budget, Phase},
    case::Case,
    chart::{Chart, without_rows},
    request::Request,
    row::Row,
    run::run,
    snow_chart::of_snow,
    stepped::Stepped,
};

/// Shares of the budget at whose end each part is over, after the reference.
const SEARCH: f64 = 0.65;
const TIMED: f64 = 0.72;
const VERIFIED: f64 = 0.85;
const TERMS: f64 = 0.98;
/// Seconds per simulated second of what keeps up with real time.
const REAL_TIME: f64 = 1.0;
/// How the cost of snow grows with the number of cells along an axis.
const SNOW: i32 = 4;

/// A candidate, and what became of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried {
    /// The name of its method.
    pub name: String,
    /// Of positions and velocities.
    pub precision: Precision,
    /// Its last row that held, among those of the plan.
    pub row: Option<usize>,
    /// Why it was given up; none where it is right enough.
    pub dropped: Option<Dropped>,
}

/// What it would take where nothing is right enough, as errors fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needed {
    /// Steps (s).
    pub dt: f64,
    /// Cells (m), of snow.
    pub cell: Option<f64>,
    /// Seconds per simulated second.
    pub seconds: f64,
}

/// The answer to what is cheapest.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Window, reference, and all rows that were tried; that which is recommended is on its front.
    pub chart: Chart,
    /// How many of the rows are of the search; those after them verify what seconds choose.
    pub searched: usize,
    /// Every method in every precision; none of snow, whose rows are those of its chart.
    pub tried: Vec<Tried>,
    /// Whether the tolerance is met until the end of the window.
    pub is_met: bool,
    /// What is recommended; where the tolerance is not met, the most accurate that was found.
    pub row: Option<Row>,
    /// How it was verified.
    pub verified: Option<Verified>,
    /// Until when (s) it meets the tolerance.
    pub met_until: f64,
    /// What it would take, where it is not met.
    pub needed: Option<Needed>,
    /// What the scene can do without; none where nothing is right enough, and of snow.
    pub terms: Vec<Term>,
    /// The most accurate that keeps up with real time.
    pub real_time: Option<Row>,
}

/// Plans a case. `tell` is called with what is done now.
pub fn plan(case: &Case, request: &Request, budget: &Budget, tell: &dyn Fn(&str)) -> Plan {
    let mut plan = match &case.setup.snow {
        Some(snow) => of_rows(of_snow(case, snow, request, budget, tell)),
        None => of_search(case, request, budget, tell),
    };
    let keeps_up = |row: &Row| row.seconds.is_some_and(|seconds| seconds <= REAL_TIME);
    plan.real_time = most_accurate(&plan.chart.rows, plan.chart.floor, keeps_up);
    plan.chart.is_stopped = budget.is_stopped();
    plan
}

fn nothing(chart: Chart) -> Plan {
    Plan {
        searched: chart.rows.len(),
        chart,
        tried: Vec::new(),
        is_met: false,
        row: None,
        verified: None,
        met_until: 0.0,
        needed: None,
        terms: Vec::new(),
        real_time: None,
    }
}

/// The row of the least error among some, of equal ones the cheapest. Rows of snow are at no less than the floor (m): nothing is
/// nearer to the truth than its reference is known to be.
fn most_accurate(rows: &[Row], floor: f64, is_one: impl Fn(&Row) -> bool) -> Option<Row> {
    let known = |row: &Row| {
        let error = if row.is_ranked() { row.error()? } else { floor };
        Some(Row { rms_error: Some(error), ..row.clone() })
    };
    let seconds = |row: &Row| row.seconds.unwrap_or(f64::INFINITY);
    let error = |row: &Row| row.error().unwrap_or(f64::INFINITY);
    rows.iter()
        .filter(|row| is_one(row))
        .filter_map(known)
        .filter(|row| row.error().is_some())
        .min_by(|a, b| error(a).total_cmp(&error(b)).then(seconds(a).total_cmp(&seconds(b))))
}

fn of_search(case: &Case, request: &Request, budget: &Budget, tell: &dyn Fn(&str)) -> Plan {
    let mut chart = without_rows(case, request, budget, tell);
    let Some(reference) = chart.reference.clone() else { return nothing(chart) };
    let mut search = Search::new(case, request, &reference, chart.scan.bound);
    if search.times.count() == 0 {
        return nothing(chart);
    }
    search.go(&budget.until(SEARCH), tell);
    let found = verified(&mut search, [&budget.until(TIMED), &budget.until(VERIFIED)], tell);
    let row = found.as_ref().map(|(row, _)| row.clone());
    let row = row.or_else(|| most_accurate(&search.rows, 0.0, |_| true));
    let met_until = row.as_ref().map_or(0.0, |row| met_until(&search, row, &budget.until(VERIFIED)));
    let terms = found.as_ref().map_or_else(Vec::new, |(row, verified)| match row.stepped {
        Stepped::Cloth(setting) => {
            let errors = [verified.error, request.tolerance];
            terms(case, &setting, &search.times, errors, &budget.until(TERMS), tell)
        }
        Stepped::Snow(_) => Vec::new(),
    });
    let (rows, tried) = sorted(&search);
    chart.is_cut |= tried.iter().any(|one| one.dropped == Some(Dropped::Time));
    let searched = rows.len();
    chart.rows = rows;
    chart.rows.extend(search.verification);
    let is_met = found.is_some();
    let needed = row.as_ref().filter(|_| !is_met).and_then(|row| needed(row, chart.tolerance));
    let is_answer = |one: &&mut Row| is_met && row.as_ref().is_some_and(|row| row.stepped == one.stepped);
    if let Some(answer) = chart.rows.iter_mut().rev().find(is_answer) {
        answer.front = true;
    }
    let verified = found.map(|(_, verified)| verified);
    Plan { searched, tried, is_met, row, verified, met_until, needed, terms, ..nothing(chart) }
}

/// Rows in the order of their candidates, and what became of these.
fn sorted(search: &Search<'_>) -> (Vec<Row>, Vec<Tried>) {
    let of_row = |row: &Row| {
        let is_its =
            |one: &Candidate| (one.name(), one.precision()) == (row.stepped.name(), row.stepped.precision());
        search.candidates.iter().position(is_its)
    };
    let mut order: Vec<usize> = (0..search.rows.len()).collect();
    order.sort_by_key(|place| of_row(&search.rows[*place]));
    let tried = search.candidates.iter().map(|one| Tried {
        name: one.name(),
        precision: one.precision(),
        row: order.iter().position(|place| one.row == Some(*place)),
        dropped: one.dropped,
    });
    let tried = tried.collect();
    (order.iter().map(|place| search.rows[*place].clone()).collect(), tried)
}

/// Until when (s) a row meets the tolerance: to the end where its error does.
fn met_until(search: &Search<'_>, row: &Row, phase: &Phase) -> f64 {
    if row.error().is_some_and(|error| error <= search.tolerance) {
        return search.times.end();
    }
    let made = run(search.case, row.stepped, &search.times, phase);
    let pairs = made.states.iter().zip(&search.places);
    let errors = pairs.map(|(found, place)| search.case.rms(found, &search.reference.states[*place]));
    let count = errors.take_while(|error| *error <= search.tolerance).count();
    search.times.marks[..count].last().map_or(0.0, |mark| search.times.time(*mark))
}

/// What it would take by the order of a row: of snow, cells by order 1.
fn needed(row: &Row, tolerance: f64) -> Option<Needed> {
    let (error, seconds) = (row.error()?, row.seconds?);
    let ratio = RIGHT * tolerance / error;
    Some(match row.stepped {
        Stepped::Cloth(setting) => {
            let shorter = ratio.powf(setting.method.order(1.0).recip());
            Needed { dt: row.dt * shorter, cell: None, seconds: seconds / shorter }
        }
        Stepped::Snow(setting) => {
            let (dt, cell) = (row.dt * ratio, Some(setting.cell * ratio));
            Needed { dt, cell, seconds: seconds / ratio.powi(SNOW) }
        }
    })
}

/// The plan of a chart of snow: its settings on the scene's cells. What its reference does not know is no promise.
fn of_rows(mut chart: Chart) -> Plan {
    let rows = &chart.rows;
    let cell = rows.iter().find(|row| row.own).and_then(|row| row.stepped.cell());
    let is_on_cells = |row: &&Row| row.stepped.cell() == cell && !row.own;
    let is_right = |row: &&Row| row.error().is_some_and(|error| error + chart.floor <= chart.tolerance);
    let seconds = |row: &Row| row.seconds.unwrap_or(f64::INFINITY);
    let right = rows.iter().filter(is_on_cells).filter(is_right);
    let found = right.min_by(|a, b| seconds(a).total_cmp(&seconds(b))).cloned();
    let is_met = found.is_some();
    let row = found.or_else(|| most_accurate(rows, chart.floor, |row| row.stepped.cell() == cell));
    let needed = row.as_ref().filter(|_| !is_met).and_then(|row| needed(row, chart.tolerance));
    let met_until = if is_met { chart.until() } else { 0.0 };
    for one in &mut chart.rows {
        one.front = is_met && row.as_ref().is_some_and(|row| row.stepped == one.stepped);
    }
    Plan { is_met, row, met_until, needed, ..nothing(chart) }
}

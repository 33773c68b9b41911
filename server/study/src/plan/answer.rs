//! A plan: what is recommended, what was tried, and what it would take where nothing is accurate enough.

use nappe_sim::math::Precision;

use super::{
    reach::{Reach, Sought},
    rest::Rested,
    search::RIGHT,
    terms::{Looked, Term},
    verify::Verified,
};
use crate::{
    chart::{Chart, Dropped, Row},
    method::Stepped,
};

/// How the cost of snow grows with the number of cells along an axis.
const SNOW: i32 = 4;
/// By how much shorter than what was run steps or cells are told at most: four halvings.
const FARTHEST: f64 = 1.0 / 16.0;

/// A method in a precision, and what became of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried {
    /// The name of its method.
    pub name: String,
    /// Of positions and velocities.
    pub precision: Precision,
    /// Its last row that held, among those of the plan.
    pub row: Option<usize>,
    /// Why it was given up; none where it is accurate enough.
    pub dropped: Option<Dropped>,
}

/// What it would take where nothing is accurate enough, as errors fall.
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
    /// How many of the rows are of the search; those after them verify it.
    pub searched: usize,
    /// Every method in every precision; none of snow, whose rows are those of its chart.
    pub tried: Vec<Tried>,
    /// Whether the tolerance is met until the end of the window: by a run, by one with half its step, and by one within what the scene
    /// allows of its state.
    pub is_met: bool,
    /// What is recommended; where the tolerance is not met, what may meet it, or else the most accurate that was found.
    pub row: Option<Row>,
    /// How it was verified.
    pub verified: Option<Verified>,
    /// How far it runs as a scene that is written with it, without what is left out; none where it was not verified.
    pub reach: Option<Reach>,
    /// What took less than nine tenths of its seconds when both were timed in turn.
    pub quicker: Option<Row>,
    /// Until when (s) it meets the tolerance.
    pub met_until: f64,
    /// What it would take, where it is not met; none where that is too far from what was run.
    pub needed: Option<Needed>,
    /// What the scene can do without; none where nothing is accurate enough.
    pub terms: Vec<Term>,
    /// How far (m) the answer moves without all that can go.
    pub together_change: Option<f64>,
    /// What is recommended, on the scene without what can go; none where nothing is left out.
    pub reduced: Option<Row>,
    /// Whether there was no time to find out what can go.
    pub is_terms_cut: bool,
    /// What is recommended, of which what lies still sleeps; none where it cannot, and of snow.
    pub rested: Option<Rested>,
    /// The most accurate that keeps up with real time.
    pub real_time: Option<Row>,
}

impl Plan {
    /// Of a chart with all of its rows, what was sought, and the terms of what was found; or else the most accurate row.
    pub(super) fn of(mut chart: Chart, sought: Sought, looked: Looked, nearest: Option<Row>) -> Self {
        let is_met = sought.met().is_some();
        let Looked { terms, together_change, reduced, is_cut: is_terms_cut } = looked;
        let (reduced, reduced_reach) = reduced.unzip();
        let (row, verified, reach) = match (sought.found, sought.unverified) {
            (Some(found), _) => (Some(found.row), Some(found.verified), reduced_reach.or(Some(found.reach))),
            (None, Some((row, verified))) => (Some(row), Some(verified), None),
            (None, None) => (nearest, None, None),
        };
        let is_answer = |one: &&mut Row| is_met && row.as_ref().is_some_and(|row| row.stepped == one.stepped);
        if let (Some(answer), Some(row)) = (chart.rows.iter_mut().rev().find(is_answer), &row) {
            *answer = Row { front: true, ..row.clone() };
        }
        let is_reach_cut = reach.as_ref().is_some_and(|reach| reach.end.cut().is_some());
        chart.is_cut |= is_terms_cut || is_reach_cut || verified.is_some_and(|verified| verified.is_cut);
        let nearest = row.as_ref().filter(|_| verified.is_none());
        // How far a search came that was cut is a matter of time.
        let needed = nearest.filter(|_| !chart.is_cut).and_then(|row| needed(row, chart.tolerance));
        Self {
            is_met,
            row,
            verified,
            reach,
            needed,
            terms,
            together_change,
            reduced,
            is_terms_cut,
            ..Self::nothing(chart)
        }
    }

    /// Of a chart, without an answer.
    pub(super) fn nothing(chart: Chart) -> Self {
        Self {
            searched: chart.rows.len(),
            chart,
            tried: Vec::new(),
            is_met: false,
            row: None,
            verified: None,
            reach: None,
            quicker: None,
            met_until: 0.0,
            needed: None,
            terms: Vec::new(),
            together_change: None,
            reduced: None,
            is_terms_cut: false,
            rested: None,
            real_time: None,
        }
    }

    /// The row of the scene that is written: of what is recommended, without what is left out.
    pub fn written(&self) -> Option<&Row> {
        self.reduced.as_ref().or(self.row.as_ref())
    }

    /// How many methods were given up for want of time: a cheaper one may be among them.
    pub fn cut_count(&self) -> usize {
        self.tried.iter().filter(|one| one.dropped == Some(Dropped::Time)).count()
    }

    /// At how many times runs were compared.
    pub fn compared_at(&self) -> usize {
        self.chart.reference.as_ref().map_or(0, |reference| reference.times.marks.len())
    }
}

/// The row of the least error among some, of equal ones the cheapest. Rows of snow are at no less than the floor (m): nothing is
/// nearer to the truth than its reference is known to be.
pub(super) fn most_accurate(rows: &[Row], floor: f64, is_one: impl Fn(&Row) -> bool) -> Option<Row> {
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

/// What it would take by the order of a row: of snow, cells by order 1. None where steps or cells are more than four halvings away from
/// those of the row.
fn needed(row: &Row, tolerance: f64) -> Option<Needed> {
    let (error, seconds) = (row.error()?, row.seconds?);
    let ratio = RIGHT * tolerance / error;
    match row.stepped {
        Stepped::Cloth(setting) => {
            let shorter = shorter(ratio, setting.method.order(1.0))?;
            Some(Needed { dt: row.dt * shorter, cell: None, seconds: seconds / shorter })
        }
        Stepped::Snow(setting) => {
            let shorter = shorter(ratio, 1.0)?;
            let (dt, cell) = (row.dt * shorter, Some(setting.cell * shorter));
            Some(Needed { dt, cell, seconds: seconds / shorter.powi(SNOW) })
        }
    }
}

/// The share of a length that leaves this share of an error, by an order; none where it is too small to be told, or no share.
fn shorter(ratio: f64, order: f64) -> Option<f64> {
    Some(ratio.powf(order.recip())).filter(|shorter| (FARTHEST..1.0).contains(shorter))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_that_are_more_than_four_halvings_away_are_not_told() {
        for (ratio, order, expected) in [
            (0.25, 2.0, Some(0.5)),
            (1.0 / 256.0, 2.0, Some(1.0 / 16.0)),
            (1.0 / 257.0, 2.0, None),
            (0.5, 1.0, Some(0.5)),
            (0.05, 1.0, None),
            (0.0, 1.0, None),
            (f64::INFINITY, 1.0, None),
            (f64::NAN, 2.0, None),
        ] {
            assert_eq!(shorter(ratio, order), expected, "{ratio} by order {order}");
        }
    }
}

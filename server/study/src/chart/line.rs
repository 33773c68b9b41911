//! A line of a chart: a method in a precision, at steps that are halved from row to row, or at ever smaller errors per step.

use nappe_sim::math::Precision;

use super::row::{Outcome, Row};
use crate::{
    case::Case,
    method::{Method, Setting, Steps},
};

/// Errors per step (m) that steps are controlled by, from row to row.
const STEP_TOLERANCES: [f64; 4] = [1e-3, 1e-4, 1e-5, 1e-6];
/// Rows that a line has before it may end for being beaten.
const ROWS: usize = 4;
/// What share of its error another row must have, for no more work, to beat it: a method of order 2 makes up for more within
/// two rows.
const BEATEN: f64 = 0.1;
/// How often an interval is halved, at most.
const MOST_LEVELS: u32 = 30;

/// A method in a precision, and its rows so far.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    method: Method,
    precision: Precision,
    is_controlled: bool,
    /// Rows that were made or tried.
    tried: u32,
    /// Rows that held.
    held: usize,
    /// Evaluations and products that its last row took, weighted, or steps that it would have made if it failed; before the
    /// first one what is expected of it.
    pub(crate) count: u64,
    /// Seconds that its last row took.
    pub(crate) seconds: f64,
    pub(crate) is_done: bool,
}

impl Line {
    /// At steps that are halved, from so many intervals on.
    pub(crate) fn fixed(method: Method, precision: Precision, intervals: u64) -> Self {
        Self {
            method,
            precision,
            is_controlled: false,
            tried: 0,
            held: 0,
            count: method.expected_count() * method.weight() * intervals,
            seconds: 0.0,
            is_done: false,
        }
    }

    /// At steps that an error allows.
    pub(crate) fn controlled(method: Method, precision: Precision, intervals: u64) -> Self {
        Self { is_controlled: true, ..Self::fixed(method, precision, intervals) }
    }

    /// Its name, without the precision.
    pub(crate) fn name(&self) -> String {
        let steps = if self.is_controlled { Steps::Controlled(0.0) } else { Steps::Divided(0) };
        Setting::new(self.method, self.precision, steps).name()
    }

    /// The setting of its next row; none where there is none. Where pins move, intervals that are longer than steps of the
    /// world are left out.
    pub(crate) fn next(&mut self, case: &Case, interval: f64) -> Option<Setting> {
        let setting = |steps| Setting::new(self.method, self.precision, steps);
        if self.is_controlled {
            let tolerance = STEP_TOLERANCES.get(self.tried as usize)?;
            self.tried += 1;
            return Some(setting(Steps::Controlled(*tolerance)));
        }
        while self.tried < MOST_LEVELS {
            let next = setting(Steps::Divided(self.tried));
            self.tried += 1;
            if next.fits(case, interval) {
                return Some(next);
            }
        }
        None
    }

    /// Takes note of its last row, the last of all, and of whether the line ends with it: its error is at most `good` (m); or
    /// after four rows that held another row has a tenth of its error for no more evaluations and products; or it has not
    /// held where another line is good for fewer of them than this one makes steps, `planned` of them.
    pub(crate) fn note(&mut self, rows: &[Row], good: f64, planned: f64) {
        let Some(last) = rows.last() else { return };
        let error = last.error();
        self.held += usize::from(error.is_some());
        self.count = self.method.weight() * last.count().max(planned as u64);
        let others = || rows.iter().filter_map(|row| Some((row.error()?, row.count())));
        self.is_done = match error {
            Some(error) if error <= good => true,
            Some(error) => {
                let is_beaten =
                    || others().any(|(other, count)| other < BEATEN * error && count <= last.count());
                self.held >= ROWS && is_beaten()
            }
            None if last.outcome == Outcome::NotKnown => true,
            None => {
                !self.is_controlled
                    && self.held == 0
                    && others().any(|(other, count)| other <= good && (count as f64) < planned)
            }
        };
    }
}

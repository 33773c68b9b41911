//! A line: a method in a precision on its way to ever shorter steps, or to ever smaller errors per step.

use nappe_sim::math::Precision;

use super::row::Row;
use crate::{
    case::Case,
    method::{Method, Setting, Steps},
    run::End,
};

/// Why a method was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dropped {
    /// It takes more evaluations and products than others that are accurate enough.
    Costly,
    /// Three of its rows failed, one after another.
    Fails,
    /// Its error no longer falls: rounding, or the reference, is what is left.
    Flat,
    /// It has no shorter steps.
    Shortest,
    /// There was no time for its next row.
    Time,
}

impl Dropped {
    /// Why, in a few words.
    pub const fn why(self) -> &'static str {
        match self {
            Self::Costly => "costs more than the cheapest",
            Self::Fails => "failed at three step sizes",
            Self::Flat => "its error no longer falls",
            Self::Shortest => "it has no shorter steps",
            Self::Time => "out of time",
        }
    }
}

/// The steps of lines, from row to row.
pub(crate) struct Tries {
    /// Those that are halved so often.
    pub(crate) halved: fn(u32) -> Steps,
    /// How many of them there are.
    pub(crate) count: u32,
    /// Errors per step (m) by which steps are controlled.
    pub(crate) tolerances: Vec<f64>,
}

/// A method in a precision on its way.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    pub(crate) method: Method,
    pub(crate) precision: Precision,
    /// Whether its steps are as long as an error allows.
    pub(crate) is_controlled: bool,
    /// The halving, or the place among errors per step, of its next row.
    pub(crate) next: u32,
    /// Errors (m) of its rows; none of those that did not hold.
    pub(crate) errors: Vec<Option<f64>>,
    /// Its last row that held, among all.
    pub(crate) row: Option<usize>,
    /// Seconds that its last row took.
    pub(crate) seconds: f64,
    /// What its next row takes at least, and what is expected of the row that is accurate enough, in units of the search.
    pub(crate) cost: f64,
    pub(crate) expected: f64,
    pub(crate) is_right: bool,
    pub(crate) dropped: Option<Dropped>,
}

/// All methods, and those whose steps are controlled, in every precision. Nothing is known yet of what they cost.
pub(crate) fn lines(precisions: &[Precision]) -> Vec<Line> {
    let fixed = Method::compared().into_iter().map(|method| (method, false));
    let all = fixed.chain(Method::controlled().into_iter().map(|method| (method, true)));
    all.flat_map(|method| precisions.iter().map(move |&precision| Line::new(method, precision))).collect()
}

impl Line {
    fn new((method, is_controlled): (Method, bool), precision: Precision) -> Self {
        Self {
            method,
            precision,
            is_controlled,
            next: 0,
            errors: Vec::new(),
            row: None,
            seconds: 0.0,
            cost: 0.0,
            expected: 0.0,
            is_right: false,
            dropped: None,
        }
    }

    /// Its name, without the precision.
    pub(crate) fn name(&self) -> String {
        let steps = if self.is_controlled { Steps::Controlled(0.0) } else { Steps::Divided(0) };
        Setting::new(self.method, self.precision, steps).name()
    }

    /// Whether it has a row that is accurate enough, or was given up.
    pub(crate) const fn is_done(&self) -> bool {
        self.is_right || self.dropped.is_some()
    }

    /// How many of its rows held.
    pub(crate) fn held(&self) -> usize {
        self.errors.iter().flatten().count()
    }

    /// The setting of its next row; none where there is none. Where pins move, intervals (s) that are longer than steps of the
    /// world are left out.
    pub(crate) fn next_setting(&mut self, tries: &Tries, case: &Case, interval: f64) -> Option<Setting> {
        loop {
            let steps = if self.is_controlled {
                Steps::Controlled(*tries.tolerances.get(self.next as usize)?)
            } else {
                (self.next < tries.count).then(|| (tries.halved)(self.next))?
            };
            self.next += 1;
            let setting = Setting::new(self.method, self.precision, steps);
            if setting.fits(case, interval) {
                return Some(setting);
            }
        }
    }

    /// Takes note of its next row, which stands at a place among all and took some seconds: with an error of at most `right` (m)
    /// it is accurate enough.
    pub(crate) fn take(&mut self, row: &Row, place: usize, seconds: f64, right: f64) {
        self.seconds = seconds;
        self.errors.push(row.error());
        if let Some(error) = row.error() {
            (self.row, self.is_right) = (Some(place), error <= right);
        }
        self.dropped = match row.end {
            End::Cut(_) => Some(Dropped::Time),
            End::Costly => Some(Dropped::Costly),
            End::Reached | End::Failed(_) => None,
        };
    }
}

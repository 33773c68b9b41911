//! A method in a precision on the way to a plan: its steps are halved until it is right enough, or dropped with a reason.

use nappe_sim::{cloth::Minimizer, math::Precision, snow::Kernel};

use crate::{
    chart::{CUBIC, Row},
    method::{Method, Setting, Stepped, Steps},
    reference::F64_COST,
};

/// Errors per step of methods whose steps are controlled, as shares of the tolerance: ten steps of the first are as far off as
/// is allowed.
const CONTROLLED: [f64; 8] = [1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4];
/// Rows one after another that fail before a candidate is dropped.
const FAILURES: u32 = 3;
/// What a row leaves of the error of the one before when it falls, and when it no longer does.
const FALLS: f64 = 0.5;
const STAYS: f64 = 0.8;
/// How often the time step of a scene is halved, at most: it is divided into 10 000 at most.
const HALVINGS: u32 = 13;
const MOST_PARTS: u32 = 10_000;
/// Errors per step (m) that a scene can ask for.
const STEP_TOLERANCES: std::ops::RangeInclusive<f64> = 1e-12..=1e3;

/// Why a candidate was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dropped {
    /// Its next row would take more evaluations and products than the cheapest that is right enough.
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
            Self::Fails => "three steps in a row fail",
            Self::Flat => "its error no longer falls",
            Self::Shortest => "it has no shorter steps",
            Self::Time => "out of time",
        }
    }
}

/// A method in a precision on its way.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    method: Method,
    precision: Precision,
    is_controlled: bool,
    /// The halving, or the place among errors per step, of its next row.
    next: u32,
    failures: u32,
    /// Rows one after another whose error stayed.
    flat: u32,
    has_fallen: bool,
    last_error: Option<f64>,
    /// What its next row takes at least, in evaluations and products of f64.
    pub(super) cost: f64,
    /// What the row is expected to take that is right enough.
    pub(super) expected: f64,
    /// Its last row that held, among all.
    pub(super) row: Option<usize>,
    pub(super) is_right: bool,
    pub(super) dropped: Option<Dropped>,
}

/// How many times as long an evaluation or product takes as one of all particles at once in f64: one by one takes longer, f32
/// less.
fn weight(method: Method, precision: Precision) -> f64 {
    method.weight() as f64 * if precision == Precision::F32 { 0.6 } else { 1.0 }
}

/// Evaluations and products of a step, at least.
const fn least(method: Method) -> f64 {
    match method.minimizer {
        _ if !method.integrator.is_implicit() => 1.0,
        Minimizer::OneStep => 3.0,
        Minimizer::Newton(_) => 5.0,
        Minimizer::VertexBlockDescent { sweeps } => sweeps as f64,
    }
}

/// What a row took, in evaluations and products of f64; of snow in steps by the quadratic kernel in f32.
pub(super) fn cost(row: &Row) -> f64 {
    let weight = match row.stepped {
        Stepped::Cloth(setting) => weight(setting.method, setting.precision),
        Stepped::Snow(setting) => {
            let precision = if setting.precision == Precision::F64 { F64_COST } else { 1.0 };
            precision * if setting.variant.kernel == Kernel::Cubic { CUBIC } else { 1.0 }
        }
    };
    weight * row.count() as f64
}

/// Whether a scene can ask for such steps.
pub(super) fn can_be_asked(steps: Steps) -> bool {
    match steps {
        Steps::Fixed(parts) => (1..=MOST_PARTS).contains(&parts),
        Steps::Controlled(tolerance) => STEP_TOLERANCES.contains(&tolerance),
        Steps::Divided(_) | Steps::Certified(_) | Steps::Own => false,
    }
}

impl Candidate {
    /// At steps that are halved, from the first halving on, over so many steps of the scene.
    pub(super) fn fixed(method: Method, precision: Precision, first: u32, steps: u64) -> Self {
        let count = steps as f64 * f64::from(first).exp2();
        Self {
            method,
            precision,
            is_controlled: false,
            next: first,
            failures: 0,
            flat: 0,
            has_fallen: false,
            last_error: None,
            cost: weight(method, precision) * least(method) * count,
            expected: weight(method, precision) * method.expected_count() as f64 * count,
            row: None,
            is_right: false,
            dropped: None,
        }
    }

    /// At steps that an error allows.
    pub(super) fn controlled(method: Method, precision: Precision, steps: u64) -> Self {
        Self { is_controlled: true, ..Self::fixed(method, precision, 0, steps) }
    }

    /// Its name, without the precision.
    pub(super) fn name(&self) -> String {
        let steps = if self.is_controlled { Steps::Controlled(0.0) } else { Steps::Fixed(1) };
        Setting::new(self.method, self.precision, steps).name()
    }

    /// Evaluations and products that its next row may take, where so many of f64 are the most.
    pub(super) fn most(&self, best: f64) -> u64 {
        (best / weight(self.method, self.precision)) as u64
    }

    pub(super) const fn precision(&self) -> Precision {
        self.precision
    }

    pub(super) const fn is_done(&self) -> bool {
        self.is_right || self.dropped.is_some()
    }

    /// The setting of its next row for a tolerance (m); none where there is none.
    pub(super) fn setting(&self, tolerance: f64) -> Option<Setting> {
        let steps = if self.is_controlled {
            let longest = 0.1 * tolerance.min(*STEP_TOLERANCES.end());
            Steps::Controlled(longest * CONTROLLED.get(self.next as usize)?)
        } else {
            (self.next <= HALVINGS).then(|| Steps::Fixed(1 << self.next))?
        };
        can_be_asked(steps).then(|| Setting::new(self.method, self.precision, steps))
    }

    /// Takes note of its next row, which stands at a place among all: its error is to be at most `right` (m).
    pub(super) fn note(&mut self, row: &Row, place: usize, right: f64) {
        self.next += 1;
        // Solves take fewer iterations when steps are shorter; controlled steps are longer by far less.
        let growth = if self.is_controlled || self.method.integrator.is_implicit() { 1.3 } else { 2.0 };
        let cost = cost(row);
        self.cost = self.cost.max(growth * cost);
        self.expected = self.cost;
        let Some(error) = row.error() else {
            self.failures += 1;
            self.dropped = (self.failures >= FAILURES).then_some(Dropped::Fails);
            return;
        };
        self.failures = 0;
        self.row = Some(place);
        self.is_right = error <= right;
        // Of order 2 at best.
        self.expected = cost * (error / right).sqrt().max(growth);
        let ratio = self.last_error.map_or(1.0, |last| error / last);
        self.flat = if ratio > STAYS { self.flat + 1 } else { 0 };
        self.has_fallen |= ratio < FALLS;
        self.last_error = Some(error);
        if !self.is_right && self.has_fallen && self.flat >= 2 {
            self.dropped = Some(Dropped::Flat);
        }
    }
}

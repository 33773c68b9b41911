//! The search for the cheapest setting that is right enough: what promises to be that is tried first, and what cannot be cheaper
//! any more is dropped.

use nappe_sim::math::Precision;

use super::candidate::{Candidate, Dropped, cost};
use crate::{
    case::{Case, Times},
    chart::{Outcome, Request, Row},
    method::{Method, Setting},
    reference::Reference,
    run::{Phase, run_within},
};

/// Share of the tolerance that the error of a run may have: the rest is for what the reference does not know.
pub(super) const RIGHT: f64 = 0.7;

/// What is searched in, and the rows so far.
pub(super) struct Search<'a> {
    pub(super) case: &'a Case,
    pub(super) tolerance: f64,
    pub(super) reference: &'a Reference,
    /// The comparison times at which steps of the scene end, and their places among those of the reference.
    pub(super) times: Times,
    pub(super) places: Vec<usize>,
    pub(super) rows: Vec<Row>,
    /// Rows of the verification.
    pub(super) verification: Vec<Row>,
    pub(super) candidates: Vec<Candidate>,
}

/// All methods, and those whose steps are controlled. Explicit steps begin within a certified bound (s).
fn candidates(case: &Case, request: &Request, bound: f64, steps: u64) -> Vec<Candidate> {
    let first = (case.dt() / bound).log2().ceil().max(0.0) as u32;
    let of = |method: Method, precision: Precision| {
        let first = if method.integrator.is_implicit() { 0 } else { first };
        Candidate::fixed(method, precision, first, steps)
    };
    let mut all = Vec::new();
    for &precision in &request.precisions {
        all.extend(Method::compared().into_iter().map(|method| of(method, precision)));
        all.extend(Method::controlled().map(|method| Candidate::controlled(method, precision, steps)));
    }
    all.retain(|candidate| request.methods.is_empty() || request.methods.contains(&candidate.name()));
    all
}

impl<'a> Search<'a> {
    /// No rows yet.
    pub(super) fn new(case: &'a Case, request: &Request, reference: &'a Reference, bound: f64) -> Self {
        let (times, places) = reference.times.coarser(case.dt());
        let steps = (times.end() / case.dt()).round() as u64;
        let candidates = candidates(case, request, bound, steps);
        let (rows, verification) = (Vec::new(), Vec::new());
        Self { case, tolerance: request.tolerance, reference, times, places, rows, verification, candidates }
    }

    /// Tries the candidate that is expected to be right for the least, until all are right or dropped. No row takes more than the
    /// cheapest that is right.
    pub(super) fn go(&mut self, phase: &Phase, tell: &dyn Fn(&str)) {
        let mut best = f64::INFINITY;
        while let Some(place) = self.most_promising() {
            let candidate = &self.candidates[place];
            let setting = candidate.setting(self.tolerance);
            let dropped = if candidate.cost > best {
                Some(Dropped::Costly)
            } else if phase.is_over() {
                Some(Dropped::Time)
            } else if setting.is_none() {
                Some(Dropped::Shortest)
            } else {
                None
            };
            let (Some(setting), None) = (setting, dropped) else {
                self.candidates[place].dropped = dropped;
                continue;
            };
            tell(&format!("{} {}", setting.name(), setting.precision));
            let most = candidate.most(best);
            let row = self.run_within(setting, &phase.share(0.5), most);
            let candidate = &mut self.candidates[place];
            candidate.note(&row, self.rows.len(), RIGHT * self.tolerance);
            if row.outcome == Outcome::NotKnown {
                candidate.dropped = Some(Dropped::Time);
            } else if row.outcome == Outcome::Costly {
                candidate.dropped = Some(Dropped::Costly);
            }
            if candidate.is_right {
                best = best.min(cost(&row));
            }
            self.rows.push(row);
        }
    }

    fn most_promising(&self) -> Option<usize> {
        let open = self.candidates.iter().enumerate().filter(|(_, candidate)| !candidate.is_done());
        open.min_by(|(_, a), (_, b)| a.expected.total_cmp(&b.expected)).map(|(place, _)| place)
    }

    /// A row of the verification.
    pub(super) fn verify(&mut self, setting: Setting, phase: &Phase) -> Row {
        let row = self.run_within(setting, phase, u64::MAX);
        self.verification.push(row.clone());
        row
    }

    /// A row of a setting at the times at which steps of the scene end, given up when it has taken more evaluations and products
    /// than these.
    fn run_within(&self, setting: Setting, phase: &Phase, most: u64) -> Row {
        let setting = setting.solved(self.case, self.tolerance, self.times.end());
        let made = run_within(self.case, (&setting).into(), &self.times, phase, most);
        Row::new(self.case, &setting, &made, (self.reference, &self.places))
    }

    /// Rows that are right enough, the cheapest first.
    pub(super) fn right(&self) -> Vec<usize> {
        let mut right: Vec<usize> =
            self.candidates.iter().filter(|one| one.is_right).filter_map(|one| one.row).collect();
        right.sort_by(|a, b| cost(&self.rows[*a]).total_cmp(&cost(&self.rows[*b])));
        right
    }
}

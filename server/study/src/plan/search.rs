//! The search for the cheapest setting that is accurate enough: what promises to be that is tried first, and what cannot be cheaper
//! any more is dropped.

use nappe_sim::{cloth::Minimizer, math::Precision, snow::Kernel};

use crate::{
    case::Case,
    chart::{CUBIC, Dropped, Line, Request, Row, Rule, Search, Tries, lines},
    method::{Method, Stepped, Steps},
    reference::{F64_COST, Reference},
    run::Phase,
};

/// Share of the tolerance that the error of a run may have: the rest is for what the reference does not know.
pub(super) const RIGHT: f64 = 0.7;
/// Errors per step of methods whose steps are controlled, as shares of the tolerance: ten steps of the first are as far off as
/// is allowed.
const CONTROLLED: [f64; 8] = [1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4];
/// Rows one after another that fail before a method is dropped.
const FAILURES: usize = 3;
/// What a row leaves of the error of the one before when it falls, and when it no longer does.
const FALLS: f64 = 0.5;
const STAYS: f64 = 0.8;
/// How often the time step of a scene is halved, at most: it is divided into 10 000 at most.
const HALVINGS: u32 = 13;
const MOST_PARTS: u32 = 10_000;
/// Errors per step (m) that a scene can ask for.
const STEP_TOLERANCES: std::ops::RangeInclusive<f64> = 1e-12..=1e3;

/// How many times as long an evaluation or product takes as one of all particles at once in f64: one by one takes longer, f32
/// less.
fn weight(method: Method, precision: Precision) -> f64 {
    method.weight() as f64 * if precision == Precision::F32 { 0.6 } else { 1.0 }
}

/// Evaluations and products of a step, at least.
const fn least(method: Method) -> f64 {
    match method.minimizer {
        _ if !method.integrator.is_implicit() => 1.0,
        Minimizer::Auto { .. } | Minimizer::OneStep => 3.0,
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

/// Some places of rows, the cheapest first.
pub(super) fn by_cost(rows: &[Row], places: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut places: Vec<usize> = places.collect();
    places.sort_by(|a, b| cost(&rows[*a]).total_cmp(&cost(&rows[*b])));
    places
}

/// Whether a scene can ask for such steps.
pub(super) fn can_be_asked(steps: Steps) -> bool {
    match steps {
        Steps::Fixed(parts) => (1..=MOST_PARTS).contains(&parts),
        Steps::Controlled(tolerance) => STEP_TOLERANCES.contains(&tolerance),
        Steps::Divided(_) | Steps::Certified(_) | Steps::Own => false,
    }
}

/// The cheapest line that is accurate enough: no row takes more than it, in evaluations and products of f64.
struct Cheapest {
    right: f64,
    best: f64,
}

impl Rule for Cheapest {
    fn right(&self) -> f64 {
        self.right
    }

    fn most(&self, line: &Line, phase: &Phase) -> Result<u64, Dropped> {
        if line.cost > self.best {
            Err(Dropped::Costly)
        } else if phase.is_over() {
            Err(Dropped::Time)
        } else {
            Ok((self.best / weight(line.method, line.precision)) as u64)
        }
    }

    fn note(&mut self, line: &mut Line, row: &Row, _: &[Row]) -> Option<Dropped> {
        // Solves take fewer iterations when steps are shorter; controlled steps are longer by far less.
        let growth = if line.is_controlled || line.method.integrator.is_implicit() { 1.3 } else { 2.0 };
        let cost = cost(row);
        line.cost = line.cost.max(growth * cost);
        line.expected = line.cost;
        let Some(error) = row.error() else {
            let failures = line.errors.iter().rev().take_while(|error| error.is_none()).count();
            return (failures >= FAILURES).then_some(Dropped::Fails);
        };
        // Of order 2 at best.
        line.expected = cost * (error / self.right).sqrt().max(growth);
        if line.is_right {
            self.best = self.best.min(cost);
        }
        is_flat(&line.errors).then_some(Dropped::Flat)
    }
}

/// Whether errors (m) that have fallen no longer do.
fn is_flat(errors: &[Option<f64>]) -> bool {
    let held: Vec<f64> = errors.iter().flatten().copied().collect();
    let ratios = || held.windows(2).map(|pair| pair[1] / pair[0]);
    ratios().any(|ratio| ratio < FALLS) && ratios().rev().take_while(|ratio| *ratio > STAYS).count() >= 2
}

/// Searches at the times at which steps of the scene end. Explicit steps begin within a certified bound (s). None where there is
/// no such time.
pub(super) fn search<'a>(
    case: &'a Case,
    request: &Request,
    (reference, bound): (&'a Reference, f64),
    phase: &Phase,
    tell: &dyn Fn(&str),
) -> Option<Search<'a>> {
    let (times, places) = reference.times.coarser(case.dt());
    if times.count() == 0 {
        return None;
    }
    let steps = (times.end() / case.dt()).round();
    let first = (case.dt() / bound).log2().ceil().max(0.0) as u32;
    let mut lines: Vec<Line> = request.precisions.iter().flat_map(|precision| lines(&[*precision])).collect();
    for line in &mut lines {
        line.next = if line.is_controlled || line.method.integrator.is_implicit() { 0 } else { first };
        let count = steps * f64::from(line.next).exp2();
        let weight = weight(line.method, line.precision);
        line.cost = weight * least(line.method) * count;
        line.expected = weight * line.method.expected_count() as f64 * count;
    }
    let longest = 0.1 * request.tolerance.min(*STEP_TOLERANCES.end());
    let mut tolerances = CONTROLLED.map(|share| longest * share).to_vec();
    tolerances.retain(|tolerance| can_be_asked(Steps::Controlled(*tolerance)));
    let tries = Tries { halved: |halvings| Steps::Fixed(1 << halvings), count: HALVINGS + 1, tolerances };
    let mut search = Search::new(case, request, (reference, times, places), tries, lines);
    search.go(&mut Cheapest { right: RIGHT * request.tolerance, best: f64::INFINITY }, phase, tell);
    Some(search)
}

/// Rows of a search that are accurate enough, the cheapest first.
pub(super) fn right(search: &Search<'_>) -> Vec<usize> {
    by_cost(&search.rows, search.lines.iter().filter(|line| line.is_right).filter_map(|line| line.row))
}

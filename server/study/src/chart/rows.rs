//! Rows of every method, each at ever shorter steps: what is cheap comes first.

use nappe_sim::math::Precision;

use super::{
    line::{Dropped, Line, Tries, lines},
    request::Request,
    row::Row,
    search::{Rule, Search},
};
use crate::{
    case::{Case, Times},
    method::{Method, Setting, Steps},
    reference::Reference,
    run::{Phase, run},
};

/// How many times as long a row takes as that of steps twice as long, with room for a busy machine.
const COST: f64 = 2.2;
/// Share of the tolerance below which a line ends.
const GOOD: f64 = 0.01;
/// Times the floor below which a line ends.
const ABOVE_FLOOR: f64 = 3.0;
/// Errors per step (m) that steps are controlled by, from row to row.
const STEP_TOLERANCES: [f64; 4] = [1e-3, 1e-4, 1e-5, 1e-6];
/// Rows that a line has before it may end for being beaten.
const ROWS: usize = 4;
/// What share of its error another row must have, for no more work, to beat it: a method of order 2 makes up for more within
/// two rows.
const BEATEN: f64 = 0.1;
/// How many rows a line of steps that are halved has, at most.
const MOST_LEVELS: u32 = 30;

/// Names of all lines, in their order.
pub(crate) fn line_names() -> Vec<String> {
    lines(&[Precision::F64]).iter().map(Line::name).collect()
}

/// Each line until its error is good (m), or until others are so much better that it is not worth its time.
struct Every<'a> {
    good: f64,
    times: &'a Times,
}

impl Rule for Every<'_> {
    fn right(&self) -> f64 {
        self.good
    }

    fn most(&self, line: &Line, phase: &Phase) -> Result<u64, Dropped> {
        let is_late = phase.is_over() || COST * line.seconds > phase.left();
        if is_late { Err(Dropped::Time) } else { Ok(u64::MAX) }
    }

    /// A line ends after four rows that held where another row has a tenth of its error for no more evaluations and products; or
    /// while it has not held, where another line is good for fewer of them than this one makes steps.
    fn note(&mut self, line: &mut Line, row: &Row, rows: &[Row]) -> Option<Dropped> {
        let interval = self.times.interval;
        let planned = self.times.end() / row.stepped.dt(interval).unwrap_or(interval);
        line.expected = (line.method.weight() * row.count().max(planned as u64)) as f64;
        let mut others = rows.iter().filter_map(|row| Some((row.error()?, row.count())));
        let is_costly = if let Some(error) = row.error() {
            let is_better = |(other, count): (f64, u64)| other < BEATEN * error && count <= row.count();
            line.held() >= ROWS && others.any(is_better)
        } else {
            let is_good = |(other, count): (f64, u64)| other <= self.good && (count as f64) < planned;
            !line.is_controlled && line.held() == 0 && others.any(is_good)
        };
        is_costly.then_some(Dropped::Costly)
    }
}

/// The scene as it is written, and the rows of all lines: always the next one of the line whose last row took the least evaluations
/// and products. Errors below `floor` (m) cannot be told. Says whether any row was left out for want of time.
pub(crate) fn rows(
    case: &Case,
    request: &Request,
    reference: &Reference,
    floor: f64,
    phase: &Phase,
    tell: &dyn Fn(&str),
) -> (Vec<Row>, bool) {
    let times = &reference.times;
    let mut lines = lines(&request.precisions);
    for line in &mut lines {
        line.expected = (line.method.expected_count() * line.method.weight() * times.count()) as f64;
    }
    // Raw steps of bodies with a thickness are refused: theirs divide those of the scene.
    let halved: fn(u32) -> Steps = if case.is_thick() { parts } else { Steps::Divided };
    let tries = Tries { halved, count: MOST_LEVELS, tolerances: STEP_TOLERANCES.to_vec() };
    let against = (reference, times.clone(), (0..reference.states.len()).collect());
    let mut search = Search::new(case, request, against, tries, lines);
    tell("the scene as it is written");
    search.rows.extend(own(case, reference, phase));
    let good = (GOOD * request.tolerance).max(ABOVE_FLOOR * floor);
    search.go(&mut Every { good, times }, phase, tell);

    let is_late = search.lines.iter().any(|line| line.dropped == Some(Dropped::Time));
    let is_cut = is_late || search.rows.iter().any(|row| row.end.cut().is_some());
    let marked = |place: usize| {
        let mut row = search.rows[place].clone();
        row.mark_below(floor);
        row
    };
    (search.order().into_iter().map(marked).collect(), is_cut)
}

/// Steps of the scene that are halved so often.
const fn parts(halvings: u32) -> Steps {
    Steps::Fixed(1 << halvings)
}

/// The scene as it is written, at the comparison times at which its steps end.
fn own(case: &Case, reference: &Reference, phase: &Phase) -> Option<Row> {
    let body = case.setup.bodies.first()?;
    let setting = Setting::new(Method::of(&body.settings), case.precision, Steps::Own);
    let (times, places) = reference.times.coarser(case.dt());
    let made = run(case, &setting, &times, phase);
    Some(Row::new(case, &setting, &made, (reference, &places)))
}

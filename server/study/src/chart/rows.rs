//! Rows of every method, each at ever shorter steps: what is cheap comes first.

use nappe_sim::math::Precision;

use super::{
    line::Line,
    request::Request,
    row::{Outcome, Row},
};
use crate::{
    case::Case,
    method::{Method, Setting, Steps},
    quantity::time,
    reference::Reference,
    run::{Phase, run},
};

/// How many times as long a row takes as that of steps twice as long, with room for a busy machine.
const COST: f64 = 2.2;
/// Share of the tolerance below which a line ends.
const GOOD: f64 = 0.01;
/// Times the floor below which a line ends.
const ABOVE_FLOOR: f64 = 3.0;

/// Names of all lines, in their order.
pub(crate) fn line_names() -> Vec<String> {
    lines(&[Precision::F64], 1).iter().map(Line::name).collect()
}

/// All methods, and those whose steps are controlled, in every precision, for so many intervals.
fn lines(precisions: &[Precision], intervals: u64) -> Vec<Line> {
    let fixed = Method::compared().into_iter().map(|method| (method, false));
    let all = fixed.chain(Method::controlled().into_iter().map(|method| (method, true)));
    all.flat_map(|(method, is_controlled)| {
        precisions.iter().map(move |&precision| {
            let new = if is_controlled { Line::controlled } else { Line::fixed };
            new(method, precision, intervals)
        })
    })
    .collect()
}

/// Rows on their way.
pub(crate) struct Rows<'a> {
    case: &'a Case,
    request: &'a Request,
    reference: &'a Reference,
    floor: f64,
    made: Vec<Row>,
    is_cut: bool,
}

impl<'a> Rows<'a> {
    /// No rows yet; errors below `floor` (m) cannot be told.
    pub(crate) fn new(case: &'a Case, request: &'a Request, reference: &'a Reference, floor: f64) -> Self {
        Self { case, request, reference, floor, made: Vec::new(), is_cut: false }
    }

    /// Makes the rows of all lines: always the next one of the line whose last row took the least evaluations and
    /// products. Says whether any was left out for want of time.
    pub(crate) fn make(mut self, phase: &Phase, tell: &dyn Fn(&str)) -> (Vec<Row>, bool) {
        tell("the scene as it is written");
        self.add_own(phase);
        let mut lines = lines(&self.request.precisions, self.reference.times.count());
        let wanted = &self.request.methods;
        lines.retain(|line| wanted.is_empty() || wanted.contains(&line.name()));
        let good = (GOOD * self.request.tolerance).max(ABOVE_FLOOR * self.floor);
        while let Some(line) = lines.iter_mut().filter(|line| !line.is_done).min_by_key(|line| line.count) {
            if phase.is_over() || COST * line.seconds > phase.left() {
                (line.is_done, self.is_cut) = (true, true);
                continue;
            }
            match line.next(self.case, self.reference.times.interval) {
                None => line.is_done = true,
                Some(setting) => self.add_next(
                    line,
                    setting.solved(self.case, self.request.tolerance, self.reference.times.end()),
                    good,
                    &phase.share(0.5),
                    tell,
                ),
            }
        }
        let order = |row: &Row| (!row.own, place(row), row.stepped.precision().name());
        // Within a line rows stand in the order in which they were made.
        self.made.sort_by_key(order);
        (self.made, self.is_cut)
    }

    /// Adds the next row of a line.
    fn add_next(&mut self, line: &mut Line, setting: Setting, good: f64, phase: &Phase, tell: &dyn Fn(&str)) {
        let (reference, times) = (self.reference, &self.reference.times);
        let dt = setting.dt(times.interval);
        let steps = dt.map_or_else(String::new, |dt| format!(", steps of {}", time(dt)));
        tell(&format!("{} {}{steps}", setting.name(), setting.precision));
        let made = run(self.case, &setting, times, phase);
        let places: Vec<usize> = (0..reference.states.len()).collect();
        self.push(Row::new(self.case, &setting, &made, (reference, &places)));
        line.seconds = made.elapsed;
        line.note(&self.made, good, times.end() / dt.unwrap_or(times.interval));
    }

    /// Adds the scene as it is written, at the comparison times at which its steps end.
    fn add_own(&mut self, phase: &Phase) {
        let Some(body) = self.case.setup.bodies.first() else { return };
        let method = Method::of(&body.settings);
        let setting = Setting::new(method, self.case.precision, Steps::Own);
        let (times, places) = self.reference.times.coarser(self.case.dt());
        let made = run(self.case, &setting, &times, phase);
        self.push(Row::new(self.case, &setting, &made, (self.reference, &places)));
    }

    fn push(&mut self, mut row: Row) {
        self.is_cut |= row.outcome == Outcome::NotKnown;
        row.below_floor = row.error().is_some_and(|error| error < self.floor);
        self.made.push(row);
    }
}

/// Where the line of a row stands among all.
fn place(row: &Row) -> usize {
    let name = row.stepped.name();
    line_names().iter().position(|known| *known == name).unwrap_or(usize::MAX)
}

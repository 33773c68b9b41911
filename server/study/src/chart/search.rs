//! The search over methods of charts and of plans: the line that promises most makes its next row, until all have ended.

use super::{
    line::{Dropped, Line, Tries},
    request::Request,
    row::Row,
};
use crate::{
    case::{Case, Times},
    method::Setting,
    quantity::time,
    reference::Reference,
    run::{Phase, run_within},
};

/// When lines end, and what is expected of them.
pub(crate) trait Rule {
    /// The error (m) at which a line is accurate enough.
    fn right(&self) -> f64;

    /// Evaluations and products that the next row of a line may take.
    ///
    /// # Errors
    /// Why it makes none.
    fn most(&self, line: &Line, phase: &Phase) -> Result<u64, Dropped>;

    /// Takes note of the last of all rows, which is that of a line: what is expected of the line now, and why it ends with it, if
    /// it does.
    fn note(&mut self, line: &mut Line, row: &Row, rows: &[Row]) -> Option<Dropped>;
}

/// What is searched in, and the rows so far.
pub(crate) struct Search<'a> {
    pub(crate) case: &'a Case,
    /// Error (m) that matters.
    pub(crate) tolerance: f64,
    pub(crate) reference: &'a Reference,
    /// Times at which runs are compared, and their places among those of the reference.
    pub(crate) times: Times,
    pub(crate) places: Vec<usize>,
    pub(crate) tries: Tries,
    pub(crate) lines: Vec<Line>,
    pub(crate) rows: Vec<Row>,
}

impl<'a> Search<'a> {
    /// No rows yet, of those lines that are asked for; where none is, of all that can step the case.
    pub(crate) fn new(
        case: &'a Case,
        request: &Request,
        (reference, times, places): (&'a Reference, Times, Vec<usize>),
        tries: Tries,
        mut lines: Vec<Line>,
    ) -> Self {
        let can_step = |line: &Line| !case.is_thick() || line.method.keeps_apart();
        let is_asked = |line: &Line| request.methods.contains(&line.name());
        lines.retain(|line| if request.methods.is_empty() { can_step(line) } else { is_asked(line) });
        let (tolerance, rows) = (request.tolerance, Vec::new());
        Self { case, tolerance, reference, times, places, tries, lines, rows }
    }

    /// Makes rows until all lines have ended. `tell` is called with what is done now.
    pub(crate) fn go(&mut self, rule: &mut dyn Rule, phase: &Phase, tell: &dyn Fn(&str)) {
        while let Some(place) = self.most_promising() {
            let line = &mut self.lines[place];
            let next = rule.most(line, phase).and_then(|most| {
                let setting = line.next_setting(&self.tries, self.case, self.times.interval);
                setting.map(|setting| (setting, most)).ok_or(Dropped::Shortest)
            });
            let (setting, most) = match next {
                Ok(next) => next,
                Err(dropped) => {
                    line.dropped = Some(dropped);
                    continue;
                }
            };
            let dt = setting.dt(self.times.interval);
            let steps = dt.map_or_else(String::new, |dt| format!(", steps of {}", time(dt)));
            tell(&format!("{} {}{steps}", setting.name(), setting.precision));
            let (row, seconds) = self.run(setting, &phase.share(0.5), most);
            let line = &mut self.lines[place];
            line.take(&row, self.rows.len(), seconds, rule.right());
            self.rows.push(row.clone());
            let ended = rule.note(line, &row, &self.rows);
            line.dropped = line.dropped.or(ended.filter(|_| !line.is_right));
        }
    }

    fn most_promising(&self) -> Option<usize> {
        let open = self.lines.iter().enumerate().filter(|(_, line)| !line.is_done());
        open.min_by(|(_, a), (_, b)| a.expected.total_cmp(&b.expected)).map(|(place, _)| place)
    }

    /// A row of a setting, given up when it has taken more evaluations and products than these; and the seconds that it took.
    pub(crate) fn run(&self, setting: Setting, phase: &Phase, most: u64) -> (Row, f64) {
        let setting = setting.solved(self.case, self.tolerance, self.times.end());
        let made = run_within(self.case, (&setting).into(), &self.times, phase, most);
        (Row::new(self.case, &setting, &made, (self.reference, &self.places)), made.elapsed)
    }

    /// Places of rows in the order of their lines, after the scene as it is written; of a line in the order in which they were made.
    pub(crate) fn order(&self) -> Vec<usize> {
        let line_of = |row: &Row| {
            let its = (row.stepped.name(), row.stepped.precision());
            self.lines.iter().position(|line| (line.name(), line.precision) == its)
        };
        let mut order: Vec<usize> = (0..self.rows.len()).collect();
        order.sort_by_cached_key(|place| (!self.rows[*place].own, line_of(&self.rows[*place])));
        order
    }
}

//! Rows of every method, in rounds of ever shorter steps: what is cheap comes first.

use nappe_sim::{
    cloth::{Hessian, Integrator, Minimizer, NewtonSettings},
    math::Precision,
};

use crate::{
    budget::Phase,
    case::Case,
    line::Line,
    method::{Method, NEWTON},
    reference::Reference,
    request::Request,
    row::{Outcome, Row},
    run::run,
    setting::{Setting, Steps},
};

/// How many times as long a row takes as that of steps twice as long, with room for a busy machine.
const COST: f64 = 2.2;
/// Share of the tolerance below which a line ends.
const GOOD: f64 = 0.01;
/// Times the floor below which a line ends.
const ABOVE_FLOOR: f64 = 3.0;

/// Names of all lines, in their order.
pub fn line_names() -> Vec<String> {
    lines(&[Precision::F64]).iter().map(Line::name).collect()
}

/// Every method, and those whose steps are controlled, in every precision.
fn lines(precisions: &[Precision]) -> Vec<Line> {
    let bdf2 = Method { minimizer: NEWTON, ..Method::new(Integrator::Bdf2, Hessian::Absolute) };
    let controlled = [
        Method::new(Integrator::VelocityVerletPredicted, Hessian::Absolute),
        Method::new(Integrator::ImplicitEuler, Hessian::Absolute),
        bdf2,
    ];
    let fixed = Method::all().into_iter().map(|method| (method, false));
    let all = fixed.chain(controlled.into_iter().map(|method| (method, true)));
    all.flat_map(|(method, is_controlled)| {
        precisions.iter().map(move |&precision| {
            if is_controlled { Line::controlled(method, precision) } else { Line::fixed(method, precision) }
        })
    })
    .collect()
}

/// Rows on their way.
pub(crate) struct Rounds<'a> {
    case: &'a Case,
    request: &'a Request,
    reference: &'a Reference,
    floor: f64,
    made: Vec<Row>,
    is_cut: bool,
}

impl<'a> Rounds<'a> {
    /// No rows yet; errors below `floor` (m) cannot be told.
    pub(crate) fn new(case: &'a Case, request: &'a Request, reference: &'a Reference, floor: f64) -> Self {
        Self { case, request, reference, floor, made: Vec::new(), is_cut: false }
    }

    /// Makes the rows of all lines, in rounds: at the comparison interval, then at half of it, and so on. Says whether any
    /// was left out for want of time.
    pub(crate) fn make(mut self, phase: &Phase, tell: &dyn Fn(&str)) -> (Vec<Row>, bool) {
        tell("the scene as it is written");
        self.add_own(phase);
        let mut lines = lines(&self.request.precisions);
        let wanted = &self.request.methods;
        lines.retain(|line| wanted.is_empty() || wanted.contains(&line.name()));
        // Seconds that the last row of each line took.
        let mut seconds = vec![0.0; lines.len()];
        let good = (GOOD * self.request.tolerance).max(ABOVE_FLOOR * self.floor);
        let times = self.reference.times.clone();
        for round in 1.. {
            if lines.iter().all(|line| line.is_done) {
                break;
            }
            for (line, seconds) in lines.iter_mut().zip(&mut seconds).filter(|(line, _)| !line.is_done) {
                if phase.is_over() || COST * *seconds > phase.left() {
                    (line.is_done, self.is_cut) = (true, true);
                    continue;
                }
                let Some(setting) = line.next(self.case, times.interval) else {
                    line.is_done = true;
                    continue;
                };
                tell(&format!("round {round}: {} in {}", setting.name(), setting.precision));
                let setting = self.solved(setting);
                *seconds = self.add(setting, &phase.share(0.5));
                let planned = times.end() / setting.dt(times.interval).unwrap_or(times.interval);
                line.note(&self.made, good, planned);
            }
        }
        let order = |row: &Row| (!row.own, place(&row.setting), row.setting.precision.name());
        // Within a line rows stand in the order in which they were made.
        self.made.sort_by_key(order);
        (self.made, self.is_cut)
    }

    /// The same with Newton's method as good as the comparison needs, and as many sweeps as the scene asks for.
    fn solved(&self, setting: Setting) -> Setting {
        let until = self.reference.times.end();
        let tolerance = self.request.tolerance / (50.0 * until * until);
        let newton = NewtonSettings { tolerance, ..NewtonSettings::default() };
        let own = self.case.setup.bodies.iter().find_map(|body| match body.settings.minimizer {
            Minimizer::VertexBlockDescent { sweeps } => Some(sweeps),
            _ => None,
        });
        let sweeps = own.unwrap_or(Minimizer::DEFAULT_SWEEPS);
        Setting { method: setting.method.with(newton, sweeps), ..setting }
    }

    /// Adds the row of a setting; returns the seconds that it took.
    fn add(&mut self, setting: Setting, phase: &Phase) -> f64 {
        let reference = self.reference;
        let made = run(self.case, &setting, &reference.times, phase);
        let places: Vec<usize> = (0..reference.states.len()).collect();
        self.push(Row::new(self.case, setting, &made, (reference, &places)));
        made.elapsed
    }

    /// Adds the scene as it is written, at the comparison times at which its steps end.
    fn add_own(&mut self, phase: &Phase) {
        let Some(body) = self.case.setup.bodies.first() else { return };
        let method = Method::of(&body.settings);
        let setting = Setting { method, precision: self.case.precision, steps: Steps::Own };
        let (times, places) = self.reference.times.coarser(self.case.dt());
        let made = run(self.case, &setting, &times, phase);
        self.push(Row::new(self.case, setting, &made, (self.reference, &places)));
    }

    fn push(&mut self, mut row: Row) {
        self.is_cut |= row.outcome == Outcome::Stopped;
        row.below_floor = row.error().is_some_and(|error| error < self.floor);
        self.made.push(row);
    }
}

/// Where the line of a setting stands among all.
fn place(setting: &Setting) -> usize {
    let name = setting.name();
    line_names().iter().position(|known| *known == name).unwrap_or(usize::MAX)
}

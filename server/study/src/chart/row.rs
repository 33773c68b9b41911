//! A row of a chart: what one run costs, and how far it is from the reference.

use nappe_sim::report::Work;

use crate::{
    case::{Case, CommonPoints},
    method::Stepped,
    reference::Reference,
    run::{End, Failure, Run},
};

/// What one run costs, and how far it is from the reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// How it was stepped.
    pub stepped: Stepped,
    /// Length of its steps (s), the mean where they vary.
    pub dt: f64,
    /// Relative residual at which its linear solves end, if it makes any.
    pub tolerance: Option<f64>,
    /// The largest over the comparison times of the rms over free particles of their distance from the reference (m), or of how far a number
    /// is from it that is measured.
    pub rms_error: Option<f64>,
    /// The largest over the comparison times of the distance of a body's centre of mass from that of the reference (m).
    pub centre_error: Option<f64>,
    /// Seconds per simulated second: the median over intervals, the first left out.
    pub seconds: Option<f64>,
    /// The smallest of them.
    pub minimum_seconds: Option<f64>,
    /// Forces and products.
    pub work: Work,
    /// Total energy at the end less that at the start (J).
    pub energy_drift: f64,
    /// The largest length over rest length of any spring.
    pub max_stretch: f64,
    /// Hash of the state that it came to.
    pub state_hash: u64,
    /// What happened to it: one that comes to its end farther from the reference than the scene is long has failed.
    pub end: End,
    /// Whether its error is less than what can be told.
    pub below_floor: bool,
    /// How large its error (m) is at most, where it is less than what can be told: how far it is from the reference, and what that is
    /// not known by.
    pub at_most: Option<f64>,
    /// Whether no other row is better in error and seconds.
    pub front: bool,
    /// Whether it is the scene as it is written.
    pub own: bool,
}

impl Row {
    /// A row of a run, compared with the places in a reference that its comparison times have.
    pub(crate) fn new(
        case: &Case,
        stepped: impl Into<Stepped>,
        run: &Run,
        against: (&Reference, &[usize]),
    ) -> Self {
        Self::compared(case, stepped.into(), run, against, None)
    }

    /// The same of a coarser copy of the case of the reference, compared where both have points in common: nothing is said of its centres.
    pub(crate) fn compared(
        case: &Case,
        stepped: Stepped,
        run: &Run,
        against: (&Reference, &[usize]),
        points: Option<&CommonPoints>,
    ) -> Self {
        let [rms_error, centre_error] = errors(case, run, against, points);
        let end = match (&run.end, rms_error) {
            (End::Reached, Some(error)) if is_near(case, error) => End::Reached,
            (End::Reached, Some(_)) => End::Failed(far(case, run)),
            (End::Reached, None) => End::Failed(too_long(case)),
            (End::Failed(_) | End::Cut(_) | End::Costly, _) => run.end.clone(),
        };
        // A state that is beyond all numbers when it is squared has no distance.
        let [rms_error, centre_error] =
            [rms_error, centre_error].map(|error| error.filter(|error| error.is_finite()));
        let interval = against.0.times.interval;
        let (seconds, minimum_seconds) = match run.end {
            End::Reached => costs(&run.seconds, run.time),
            End::Costly => (None, None),
            End::Failed(_) | End::Cut(_) => {
                let cost = (run.tried > 0.0).then(|| run.elapsed / run.tried);
                (cost, cost)
            }
        };
        let solver = case.setup.bodies.first().map(|body| body.settings);
        let tolerance = match stepped {
            Stepped::Cloth(setting) => solver.and_then(|mut settings| {
                setting.configure(&mut settings, interval);
                setting.method.solver_tolerance(&settings)
            }),
            Stepped::Snow(_) => None,
        };
        let Run { dt, work, energy_drift, max_stretch, state_hash, .. } = *run;
        Self {
            stepped,
            dt,
            tolerance,
            rms_error,
            centre_error,
            seconds,
            minimum_seconds,
            work,
            energy_drift,
            max_stretch,
            state_hash,
            end,
            below_floor: false,
            at_most: None,
            front: false,
            own: stepped.is_own(),
        }
    }

    /// Takes over seconds of intervals of a run (s) over a simulated time (s).
    pub(crate) fn time_again(&mut self, seconds: &[f64], time: f64) {
        (self.seconds, self.minimum_seconds) = costs(seconds, time);
    }

    /// Evaluations and products together: a cost that no machine disturbs.
    pub fn count(&self) -> u64 {
        self.work.force_evaluations + self.work.matrix_products
    }

    /// Whether it may be called better than others: not where its error is less than what can be told of snow, whose reference
    /// is not much nearer to the truth than rows are.
    pub(crate) const fn is_ranked(&self) -> bool {
        !(self.below_floor && matches!(self.stepped, Stepped::Snow(_)))
    }

    /// Notes whether its error is below a floor (m), under which errors cannot be told.
    pub(crate) fn mark_below(&mut self, floor: f64) {
        let below = self.error().filter(|error| *error < floor);
        self.below_floor = below.is_some();
        self.at_most = below.map(|error| error + floor);
    }

    /// What its error (m) is known to be: it, or what it is at most.
    pub fn told(&self) -> Option<f64> {
        self.error().map(|error| self.at_most.unwrap_or(error))
    }

    /// Its error (m), where it reached its end near the reference.
    pub fn error(&self) -> Option<f64> {
        self.rms_error.filter(|_| self.end == End::Reached)
    }
}

/// The largest distances (m) of a run from places in a reference: of free particles, or of points in common, and of centres of mass.
fn errors(
    case: &Case,
    run: &Run,
    (reference, places): (&Reference, &[usize]),
    points: Option<&CommonPoints>,
) -> [Option<f64>; 2] {
    let largest = |distance: &dyn Fn(&[f64], &[f64]) -> f64| {
        let is_whole = run.end == End::Reached && !places.is_empty();
        let pairs = run.states.iter().zip(places.iter().map(|place| &reference.states[*place]));
        is_whole.then(|| pairs.map(|(found, known)| distance(found, known)).fold(0.0, f64::max))
    };
    let has_centres = points.is_none() && case.measure().is_of_positions();
    let centre = has_centres.then(|| largest(&|a, b| case.centre_distance(a, b))).flatten();
    [largest(&|found, known| CommonPoints::apart(points, case, found, known)), centre]
}

/// Whether an error (m) is that of an answer at all. Where all particles start at one place, every finite one is.
fn is_near(case: &Case, error: f64) -> bool {
    let length = case.diagonal();
    error <= length || (length == 0.0 && error.is_finite())
}

fn far(case: &Case, run: &Run) -> Failure {
    let cause = format!("it is farther from the reference than the scene is long, {} m", case.diagonal());
    Failure { cause, time: run.time, particle: None, is_refusal: false }
}

fn too_long(case: &Case) -> Failure {
    let cause = format!("its steps of {} s end at no time at which runs are compared", case.dt());
    Failure { cause, time: 0.0, particle: None, is_refusal: true }
}

/// Median and minimum of the seconds per simulated second, from those of equal intervals of a time (s).
fn costs(seconds: &[f64], time: f64) -> (Option<f64>, Option<f64>) {
    let interval = time / seconds.len() as f64;
    let least = counted(seconds).iter().copied().reduce(f64::min);
    (median_seconds(seconds).map(|median| median / interval), least.map(|least| least / interval))
}

/// The intervals that count: the first one makes room and fills caches.
fn counted(seconds: &[f64]) -> &[f64] {
    if seconds.len() > 1 { &seconds[1..] } else { seconds }
}

/// The median of the seconds of intervals, the first left out; none without any.
pub(crate) fn median_seconds(seconds: &[f64]) -> Option<f64> {
    let mut counted = counted(seconds).to_vec();
    counted.sort_unstable_by(f64::total_cmp);
    let middle = counted.len() / 2;
    if counted.len().is_multiple_of(2) {
        Some(f64::midpoint(*counted.get(middle.checked_sub(1)?)?, counted[middle]))
    } else {
        counted.get(middle).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_interval_never_counts() {
        assert_eq!(costs(&[9.0, 2.0, 1.0, 3.0], 4.0), (Some(2.0), Some(1.0)));
        assert_eq!(costs(&[9.0, 2.0, 1.0], 1.5), (Some(3.0), Some(2.0)));
        assert_eq!(costs(&[9.0], 0.5), (Some(18.0), Some(18.0)));
        assert_eq!(costs(&[], 0.0), (None, None));
    }
}

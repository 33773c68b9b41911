//! One run of a study of stability: what became of it, seen step by step.

use nappe_sim::{cloth::Integrator, math::Precision};

use super::{
    ground::Ground,
    row::{Over, StabilityRow},
};
use crate::{
    case::{Case, Times},
    method::{Method, Setting, Steps},
    run::{End, Failure, Phase, Runner, Verdict},
};

/// Energy over that of the start up to which a motion about rest is stable.
const MOST_AT_REST: f64 = 100.0;
/// Rise of the energy under load up to which a run is stable.
const MOST_UNDER_LOAD: f64 = 0.5;
/// Times the tolerance beyond which a stable run is wrong.
pub const WRONG: f64 = 10.0;
/// By how much (share) explicit Euler may gain energy about rest: what rounding does.
const ROUNDING: f64 = 1e-10;
/// Error (m) that solves about rest are good to.
const AT_REST: f64 = 1e-6;

/// Judges a run step by step.
pub(super) trait Judge {
    /// Looks at the state after a step; what ends the run.
    fn look(&mut self, runner: &Runner) -> Option<Verdict>;
    /// What became of it when all steps were taken.
    fn verdict(&self, runner: &Runner) -> Verdict;
    /// What its energy came to.
    fn growth(&self) -> f64;
}

/// A motion about rest: no more than a hundred times its energy. Explicit Euler without enough damping gains in every step,
/// however slowly, and has a measure of it where there is one damping over stiffness, or none.
pub(super) struct AtRest<'a> {
    rest: &'a Case,
    start: f64,
    largest: f64,
    /// Of explicit Euler: the measure of the start.
    measure: Option<f64>,
}

impl<'a> AtRest<'a> {
    pub(super) fn new(rest: &'a Case, method: Method) -> Self {
        let measure = (method.integrator == Integrator::ExplicitEuler).then_some(0.0);
        Self { rest, start: 0.0, largest: 0.0, measure }
    }

    /// v² + c x v + w² x² of every mode together (J): a step of explicit Euler multiplies that of each mode which swings by
    /// 1 - h c + h² w², while its energy goes up and down.
    fn measure(&self, runner: &Runner) -> f64 {
        2.0 * moved(runner) + self.rest.damped_virial(&runner.positions(), &runner.velocities())
    }
}

impl Judge for AtRest<'_> {
    fn look(&mut self, runner: &Runner) -> Option<Verdict> {
        if runner.step_count() == 0 {
            self.start = moved(runner);
            self.measure = self.measure.map(|_| self.measure(runner));
        }
        self.largest = self.largest.max(moved(runner));
        (self.largest > MOST_AT_REST * self.start).then_some(Verdict::Grows)
    }

    fn verdict(&self, runner: &Runner) -> Verdict {
        let gains = self.measure.is_some_and(|start| self.measure(runner) > start * (1.0 + ROUNDING));
        if gains { Verdict::Grows } else { Verdict::Stable }
    }

    fn growth(&self) -> f64 {
        self.largest / self.start.max(f64::MIN_POSITIVE)
    }
}

/// The scene itself, against a fine run of it.
pub(super) struct UnderLoad<'a> {
    case: &'a Case,
    ground: &'a Ground,
    tolerance: f64,
    growth: f64,
    error: f64,
}

impl<'a> UnderLoad<'a> {
    pub(super) fn new(case: &'a Case, ground: &'a Ground, tolerance: f64) -> Self {
        Self { case, ground, tolerance, growth: 0.0, error: 0.0 }
    }
}

impl Judge for UnderLoad<'_> {
    fn look(&mut self, runner: &Runner) -> Option<Verdict> {
        let time = runner.time();
        self.growth = self.growth.max(self.ground.rise(time, runner.now.total_energy()));
        if self.error <= WRONG * self.tolerance && time <= self.ground.window * (1.0 + 1e-9) {
            let error = self.ground.error(self.case, time, &runner.positions());
            self.error = self.error.max(error.unwrap_or(0.0));
        }
        (self.growth > MOST_UNDER_LOAD).then_some(Verdict::Grows)
    }

    fn verdict(&self, _: &Runner) -> Verdict {
        if self.error > WRONG * self.tolerance { Verdict::Wrong } else { Verdict::Stable }
    }

    fn growth(&self) -> f64 {
        self.growth
    }
}

/// The scene as the program runs it, which is given time to say that it lost its way.
pub(super) struct AsRun<'a>(pub(super) UnderLoad<'a>);

impl Judge for AsRun<'_> {
    fn look(&mut self, runner: &Runner) -> Option<Verdict> {
        let _ = self.0.look(runner);
        None
    }

    fn verdict(&self, runner: &Runner) -> Verdict {
        if self.0.growth > MOST_UNDER_LOAD { Verdict::Grows } else { self.0.verdict(runner) }
    }

    fn growth(&self) -> f64 {
        self.0.growth
    }
}

/// Kinetic and elastic energy (J).
fn moved(runner: &Runner) -> f64 {
    runner.now.kinetic_energy + runner.now.elastic_energy
}

/// What is run: a case by a method, in steps of a length (s), so many.
#[derive(Clone, Copy)]
pub(super) struct Probe<'a> {
    pub(super) case: &'a Case,
    pub(super) method: Method,
    pub(super) dt: f64,
    pub(super) steps: u64,
    pub(super) over: Over,
}

impl Probe<'_> {
    /// Takes raw steps until they are all taken, or it is clear what becomes of them.
    pub(super) fn run(&self, judge: &mut dyn Judge, phase: &Phase) -> StabilityRow {
        let setting = Setting::new(self.method, Precision::F64, Steps::Divided(0)).good_to(AT_REST);
        self.run_as(setting, judge, phase)
    }

    /// The same of a scene, judged by a fine run of it and by an error that matters (m): limits and cells of maps are.
    pub(super) fn judged(&self, ground: &Ground, tolerance: f64, phase: &Phase) -> StabilityRow {
        let setting = Setting::new(self.method, Precision::F64, Steps::Divided(0));
        let setting = setting.solved(self.case, tolerance, ground.window.max(self.dt));
        self.run_as(setting, &mut UnderLoad::new(self.case, ground, tolerance), phase)
    }

    /// The same as a setting says.
    pub(super) fn run_as(&self, setting: Setting, judge: &mut dyn Judge, phase: &Phase) -> StabilityRow {
        let case = self.case.with_dt(self.dt);
        let mut row = self.row();
        let mut runner = match Runner::start(&case, &setting, &Times::even(self.dt, 1), phase) {
            Ok(runner) => runner,
            Err(failure) => {
                (row.verdict, row.cause) = (Verdict::Refused, Some(failure.cause));
                return row;
            }
        };
        let integrator = self.method.integrator;
        // The bound is one of symplectic Euler, which both forms of velocity Verlet keep too.
        let has_bound = !integrator.is_implicit() && integrator != Integrator::ExplicitEuler;
        row.bound = Some(runner.bound()).filter(|bound| has_bound && bound.is_finite());
        let mut ended = judge.look(&runner);
        while ended.is_none() && runner.step_count() < self.steps {
            ended = match runner.advance() {
                Ok(_) if setting.steps == Steps::Divided(0) && runner.taken.indefinite > 0 => {
                    Some(Verdict::Indefinite)
                }
                Ok(_) => judge.look(&runner),
                Err(End::Failed(failure)) => Some(failed(&mut row, &runner, failure)),
                Err(End::Cut(_) | End::Costly | End::Reached) => Some(Verdict::NotKnown),
            };
        }
        row.verdict = ended.unwrap_or_else(|| judge.verdict(&runner));
        if row.verdict == Verdict::NotKnown {
            // How far it came is nothing but a matter of time.
            let cut = phase.cut();
            (row.cut, row.cause) = (Some(cut), Some(cut.why().to_owned()));
            return row;
        }
        row.growth = Some(judge.growth()).filter(|growth| growth.is_finite());
        if !row.verdict.holds() && row.step.is_none() {
            row.step = Some(runner.step_count().saturating_sub(1));
        }
        row.cause = row.cause.or_else(|| cause(row.verdict, self.over));
        row.taken = [runner.taken.substeps, runner.taken.rejected];
        row
    }

    /// A row without a result.
    pub(super) fn row(&self) -> StabilityRow {
        StabilityRow::new(self.method, self.over, self.dt)
    }
}

fn failed(row: &mut StabilityRow, runner: &Runner, failure: Failure) -> Verdict {
    row.step = Some(runner.step_count());
    (row.cause, row.particle) = (Some(failure.cause), failure.particle);
    if failure.is_refusal { Verdict::Refused } else { Verdict::Diverged }
}

fn cause(verdict: Verdict, over: Over) -> Option<String> {
    let text = match (verdict, over) {
        (Verdict::Grows, Over::Rest) => "its energy grows beyond what a stable step leaves",
        (Verdict::Grows, _) => {
            "its energy rises above that of a fine run by more than half of the largest kinetic and elastic energy"
        }
        (Verdict::Wrong, _) => "its error exceeds ten times the tolerance before the predictability horizon",
        (Verdict::Indefinite, _) => "a linear solve met a curvature that is not positive",
        _ => return None,
    };
    Some(text.to_owned())
}

//! The linear solve of an implicit step, with the matrix and right-hand side that an evaluation made.

use super::{common_part::CommonPart, mix::Mix, update::Step};
use crate::{
    cloth::{
        evaluate::{StepMatrix, Workspace, pattern},
        layout::Model,
        settings::ClothSettings,
    },
    interrupt::Interrupt,
    linalg::{
        CoarseLayout, LinearOperator, OperatorKind, Outcome, PreconditionerKind, SolveReport, SolverSettings,
        System, solve,
    },
    math::{Padded, Real, Sixteen},
    parallel::{per_sixteen, per_sixteen_mut, size},
    report::{Stage, StepFailure},
};

/// Which state was evaluated.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum At {
    /// That at the start of the step: its solve may start from that of the step before.
    State,
    /// The same, of which surfaces are kept apart: the solve of a round, counted from 0, with the pairs that push. From the second on it starts
    /// from that of the round before.
    Round(u32),
    /// The iterate in the workspace's `next`.
    Iterate,
}

/// Where the solution of a solve starts from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Guess {
    Zero,
    StepBefore,
    RoundBefore,
}

impl At {
    fn guess(self, settings: &ClothSettings) -> Guess {
        match self {
            Self::State | Self::Round(0) if settings.solver.warm_start => Guess::StepBefore,
            Self::State | Self::Round(0) | Self::Iterate => Guess::Zero,
            Self::Round(_) => Guess::RoundBefore,
        }
    }
}

impl<R: Real> Step<'_, R> {
    /// Solves for the change of velocity, into the `dv` of the next state.
    pub(super) fn solve(&mut self, at: At, settings: &ClothSettings, interrupt: &Interrupt) -> SolveReport {
        // What pairs push does not move as one.
        let common = if self.has_rows_of_pairs(at) { None } else { self.take_common_part() };
        self.fill_coarse(at, settings, interrupt);
        let report = self.conjugate(at, common.as_ref(), settings, interrupt);
        self.give_back(common.as_ref());
        report
    }

    /// Solves for the change of the iterate in `next`, which was evaluated with a tangent that is positive semi-definite:
    /// that one preconditions. The solve is made with the first mix of tangents, and again with more of the absolute one
    /// where it meets a curvature that is not positive, up to the last. Returns how the last solve ended, with what all
    /// took, and its mix.
    pub(super) fn solve_mixed(
        &mut self,
        [first, last]: [Mix; 2],
        settings: &ClothSettings,
        interrupt: &Interrupt,
    ) -> (SolveReport, Mix) {
        let common = self.take_common_part();
        self.fill_coarse(At::Iterate, settings, interrupt);
        let (mut mix, mut given_up) = (first, None::<SolveReport>);
        let report = loop {
            let Workspace { evaluation, numbers, next, scratches, .. } = &mut *self.work;
            evaluation.freeze_springs(self.model, numbers, &next.x, mix.mirror(), scratches);
            let solved = self.conjugate(At::Iterate, common.as_ref(), settings, interrupt);
            let report = given_up.map_or(solved, |before| solved.beside(before));
            if mix >= last || !is_not_positive(report.outcome) {
                break report;
            }
            (mix, given_up) = (mix.with_more(), Some(report));
        };
        self.give_back(common.as_ref());
        (report, mix)
    }

    /// Whether the right-hand side of a solve is what contact keeps of it, with what pairs push: from the first round on in which any does.
    fn has_rows_of_pairs(&self, at: At) -> bool {
        matches!(at, At::Round(round) if round > 0 || !self.work.contact.rows.is_empty())
    }

    /// Writes the matrix on the coarse space, where the preconditioner has one, from the tangent as it is frozen.
    fn fill_coarse(&mut self, at: At, settings: &ClothSettings, interrupt: &Interrupt) {
        let (model, state) = (self.model, self.state);
        let Some(layout) = layout(model, settings) else { return };
        let Workspace { evaluation, numbers, next, coarse, scratches, .. } = &mut *self.work;
        let x = if at == At::Iterate { &next.x } else { &state.x };
        let matrix = StepMatrix::new((model, &*numbers), x, evaluation, scratches, interrupt);
        coarse.fill(layout, &|block, blocks| matrix.project(layout, block, blocks));
    }

    /// Solves with the tangent as it is frozen, but for the common part.
    fn conjugate(
        &mut self,
        at: At,
        common: Option<&CommonPart<R>>,
        settings: &ClothSettings,
        interrupt: &Interrupt,
    ) -> SolveReport {
        let (model, state) = (self.model, self.state);
        let has_rows_of_pairs = self.has_rows_of_pairs(at);
        let guess = at.guess(settings);
        let solver = &SolverSettings { warm_start: guess != Guess::Zero, ..settings.solver };
        let Workspace { evaluation, numbers, next, assembled, coarse, cg, scratches, contact, .. } =
            &mut *self.work;
        let groups = evaluation.rows.len();
        size(&mut next.dv, groups);
        let own = model.share.own();
        let begin = |dv: &mut [Sixteen<R>]| {
            if guess == Guess::StepBefore && state.dv.len() == groups {
                let fields = (per_sixteen_mut(dv), per_sixteen(&state.dv));
                own.each(fields, |_, (dv, before)| dv.copy_from_slice(before));
                if let Some(common) = common {
                    common.take_off(model, dv);
                }
            } else if guess == Guess::StepBefore {
                own.each(per_sixteen_mut(dv), |_, dv| dv.fill(Sixteen::default()));
            }
        };

        let numbers = &*numbers;
        let x = if at == At::Iterate { &next.x } else { &state.x };
        let pairs = Some(&contact.rows).filter(|rows| has_rows_of_pairs && !rows.is_empty());
        let matrix = StepMatrix::new((model, numbers), x, evaluation, scratches, interrupt).with(pairs);
        let (b, inverse) = match pairs {
            Some(rows) => (&rows.b[..], &rows.inverse[..]),
            None if has_rows_of_pairs => (contact.rows.kept(), &evaluation.inverse[..]),
            None => (&evaluation.rows[..], &evaluation.inverse[..]),
        };
        let stored;
        let operator: &dyn LinearOperator<R> = match solver.operator {
            OperatorKind::MatrixFree => &matrix,
            OperatorKind::Assembled => {
                let room = assembled.get_or_insert_with(|| pattern(model));
                matrix.assemble(room);
                stored = Interruptible { operator: &*room, interrupt };
                &stored
            }
        };
        let coarse = layout(model, settings).map(|layout| (layout, &*coarse));
        let system = System { operator, b, inverse, coarse };
        let report = solve(&system, &mut next.dv, &begin, solver, &model.share, cg);
        self.work.products += u64::from(report.products);
        report
    }

    /// Adds the common part to a change of velocity that was solved for.
    fn give_back(&mut self, common: Option<&CommonPart<R>>) {
        if let Some(common) = common {
            let Workspace { next, cg, .. } = &mut *self.work;
            common.add(self.model, &mut next.dv);
            cg.lower(common.descent);
        }
        self.watch.lap(Stage::Solve);
    }
}

/// The coarse space of the preconditioner, where the settings ask for one.
fn layout<'a, R: Real>(model: &'a Model<R>, settings: &ClothSettings) -> Option<&'a CoarseLayout> {
    model.coarse.as_ref().filter(|_| settings.solver.preconditioner == PreconditionerKind::TwoLevel)
}

/// Whether a solve met a curvature that is not positive.
fn is_not_positive(outcome: Outcome) -> bool {
    matches!(
        outcome,
        Outcome::NegativeCurvature { .. } | Outcome::ZeroCurvature { .. } | Outcome::Singular { .. }
    )
}

/// Refuses a solve that solved nothing, not even for gravity.
pub(super) fn check(report: &SolveReport) -> Result<(), StepFailure> {
    match report.outcome {
        Outcome::NotFinite { .. }
        | Outcome::Singular { .. }
        | Outcome::IndefinitePreconditioner { iteration: 0 } => {
            Err(StepFailure::Solver { outcome: report.outcome })
        }
        Outcome::Converged
        | Outcome::IterationCap
        | Outcome::NegativeCurvature { .. }
        | Outcome::ZeroCurvature { .. }
        | Outcome::IndefinitePreconditioner { .. } => Ok(()),
    }
}

/// An operator whose solve can be given up.
struct Interruptible<'a, R> {
    operator: &'a dyn LinearOperator<R>,
    interrupt: &'a Interrupt,
}

impl<R: Real> LinearOperator<R> for Interruptible<'_, R> {
    fn apply(&self, first_row: usize, p: &[Padded<R>], q: &mut [Sixteen<R>]) -> [f64; 2] {
        self.operator.apply(first_row, p, q)
    }

    fn is_interrupted(&self) -> bool {
        self.interrupt.is_requested()
    }
}

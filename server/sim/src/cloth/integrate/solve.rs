//! The linear solve of an implicit step, with the matrix and right-hand side that an evaluation made.

use super::update::Step;
use crate::{
    cloth::{
        evaluate::{StepMatrix, Workspace, pattern},
        settings::ClothSettings,
    },
    interrupt::Interrupt,
    linalg::{
        LinearOperator, OperatorKind, Outcome, PreconditionerKind, SolveReport, SolverSettings, System, solve,
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
        let (model, state) = (self.model, self.state);
        let pairs_alone = matches!(at, At::Round(round) if round > 0 || !self.work.contact.rows.is_empty());
        // What pairs push does not move as one.
        let common = if pairs_alone { None } else { self.take_common_part() };
        let guess = at.guess(settings);
        let solver = &SolverSettings { warm_start: guess != Guess::Zero, ..settings.solver };
        let Workspace {
            evaluation,
            numbers,
            next,
            assembled,
            coarse: coarse_matrix,
            cg,
            scratches,
            contact,
            ..
        } = &mut *self.work;
        let groups = evaluation.rows.len();
        size(&mut next.dv, groups);
        let own = model.share.own();
        let begin = |dv: &mut [Sixteen<R>]| {
            if guess == Guess::StepBefore && state.dv.len() == groups {
                let fields = (per_sixteen_mut(dv), per_sixteen(&state.dv));
                own.each(fields, |_, (dv, before)| dv.copy_from_slice(before));
                if let Some(common) = &common {
                    common.take_off(model, dv);
                }
            } else if guess == Guess::StepBefore {
                own.each(per_sixteen_mut(dv), |_, dv| dv.fill(Sixteen::default()));
            }
        };

        let numbers = &*numbers;
        let x = if at == At::Iterate { &next.x } else { &state.x };
        let pairs = Some(&contact.rows).filter(|rows| pairs_alone && !rows.is_empty());
        let matrix = StepMatrix::new((model, numbers), x, evaluation, scratches, interrupt).with(pairs);
        let (b, inverse) = match pairs {
            Some(rows) => (&rows.b[..], &rows.inverse[..]),
            None if pairs_alone => (contact.rows.kept(), &evaluation.inverse[..]),
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
        let coarse = model.coarse.as_ref().filter(|_| solver.preconditioner == PreconditionerKind::TwoLevel);
        let coarse = coarse.map(|layout| {
            coarse_matrix.fill(layout, &|block, blocks| matrix.project(layout, block, blocks));
            (layout, &*coarse_matrix)
        });
        let system = System { operator, b, inverse, coarse };
        let report = solve(&system, &mut next.dv, &begin, solver, &model.share, cg);
        if let Some(common) = &common {
            common.add(model, &mut next.dv);
            cg.lower(common.descent);
        }
        self.work.products += u64::from(report.products);
        self.watch.lap(Stage::Solve);
        report
    }
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

//! The linear solve of an implicit step, with the matrix and right-hand side that an evaluation made.

use super::{
    at::{At, Guess},
    common_part::CommonPart,
    mix::Mix,
    solver::Linear,
    update::Step,
};
use crate::{
    cloth::{
        evaluate::{Evaluated, StepMatrix},
        settings::ClothSettings,
        state::State,
    },
    interrupt::Interrupt,
    linalg::{Outcome, PreconditionerKind, SolveReport, SolverSettings, Stop},
    math::{Real, Sixteen},
    parallel::{per_sixteen, per_sixteen_mut, size},
    report::{Stage, StepFailure},
};

/// Iterations after which a solve goes on with patches, where it may; or fewer, where its cap is lower.
const SWITCHED_AFTER: u32 = 200;
/// One solve in so many that begin with patches begins with what the settings say.
const TRIED_AGAIN: u32 = 32;

impl<R: Real> Step<'_, R> {
    /// Solves for the change of velocity, into the `dv` of the next state.
    pub(super) fn solve(&mut self, at: At, settings: &ClothSettings, interrupt: &Interrupt) -> SolveReport {
        self.solver.solves += 1;
        // What pairs push does not move as one.
        let common = if self.has_rows_of_pairs(at) { None } else { self.take_common_part() };
        let kind = self.choose(settings);
        self.set_up(at, kind, interrupt);
        let report = self.solve_on(at, common.as_ref(), (kind, None), settings, interrupt);
        self.give_back(common.as_ref());
        report
    }

    /// Solves for the change of the iterate in `next`, which was evaluated with a tangent that is positive semi-definite:
    /// that one preconditions. The solve is made with the first mix of tangents, and again with more of the absolute one
    /// where it meets a curvature that is not positive, up to the last. Returns how the last solve ended, with what all
    /// took, and its mix.
    pub(super) fn solve_mixed(
        &mut self,
        at: At,
        [first, last]: [Mix; 2],
        settings: &ClothSettings,
        interrupt: &Interrupt,
    ) -> (SolveReport, Mix) {
        self.solver.solves += 1;
        let common = self.take_common_part();
        let mut kind = self.choose(settings);
        self.set_up(at, kind, interrupt);
        let (mut mix, mut given_up) = (first, None::<SolveReport>);
        let report = loop {
            self.freeze(mix);
            let solved = self.solve_on(at, common.as_ref(), (kind, Some(mix)), settings, interrupt);
            kind = solved.preconditioner.unwrap_or(kind);
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
        matches!(at, At::Round(round) if round > 0 || !self.contact.rows.is_empty())
    }

    /// Freezes springs and elements with a mix of tangents, at the iterate in `next`.
    fn freeze(&mut self, mix: Mix) {
        let Evaluated { evaluation, numbers, scratches, .. } = &mut *self.evaluated;
        evaluation.freeze_again(self.model, numbers, &self.next.x, mix.mirror(), scratches);
    }

    /// Freezes springs and elements as they were evaluated, at the iterate in `next`.
    fn freeze_as_evaluated(&mut self) {
        let Evaluated { evaluation, numbers, scratches, .. } = &mut *self.evaluated;
        let mirror = numbers.mirror.to_f64();
        evaluation.freeze_again(self.model, numbers, &self.next.x, mirror, scratches);
    }

    /// The preconditioner that the next solve begins with. Where one before came to its cap it is the patches that led on,
    /// but now and then what the settings say is tried again.
    fn choose(&mut self, settings: &ClothSettings) -> PreconditionerKind {
        let since = &mut self.next.since_cap;
        if self.model.patches.is_none() || *since == 0 {
            return settings.solver.preconditioner;
        }
        *since = (*since + 1) % TRIED_AGAIN;
        if *since == 0 { settings.solver.preconditioner } else { PreconditionerKind::Patches }
    }

    /// Solves as [`Self::conjugate`] does, and goes on with patches that are set up for it where that takes too many iterations
    /// without, or with others that were kept.
    fn solve_on(
        &mut self,
        at: At,
        common: Option<&CommonPart<R>>,
        (kind, mix): (PreconditionerKind, Option<Mix>),
        settings: &ClothSettings,
        interrupt: &Interrupt,
    ) -> SolveReport {
        let may_switch = settings.may_switch() && self.model.patches.is_some();
        let limit = match kind {
            PreconditionerKind::Patches => self.limit_of_kept(at, settings.solver.stop),
            _ => may_switch.then_some(SWITCHED_AFTER),
        };
        let stop = match (settings.solver.stop, limit) {
            (Stop::Residual { tolerance, max_iterations }, Some(limit)) => {
                Stop::Residual { tolerance, max_iterations: max_iterations.min(limit) }
            }
            (stop, _) => stop,
        };
        let solver = SolverSettings { stop, preconditioner: kind, ..settings.solver };
        let guess = at.guess(settings);
        let report = self.conjugate((at, guess), common, solver, interrupt);
        let is_capped = report.outcome == Outcome::IterationCap && !interrupt.is_requested();
        if limit.is_none() || !is_capped {
            self.note((at, guess), kind, &report, settings.solver.stop);
            return report;
        }

        if kind == PreconditionerKind::Patches {
            self.next.kept.forget();
        } else {
            self.next.since_cap = 1;
        }
        let kind = PreconditionerKind::Patches;
        // Patches are made of the tangent that was evaluated, which is positive semi-definite.
        if mix.is_some() {
            self.freeze_as_evaluated();
        }
        self.set_up(at, kind, interrupt);
        if let Some(mix) = mix {
            self.freeze(mix);
        }
        let solver = SolverSettings { preconditioner: kind, ..settings.solver };
        let second = self.conjugate((at, at.again()), common, solver, interrupt);
        self.note((at, at.again()), kind, &second, settings.solver.stop);
        second.beside(report)
    }

    /// Solves with the tangent as it is frozen, but for the common part.
    fn conjugate(
        &mut self,
        (at, guess): (At, Guess),
        common: Option<&CommonPart<R>>,
        settings: SolverSettings,
        interrupt: &Interrupt,
    ) -> SolveReport {
        let (model, state) = (self.model, self.state);
        let has_rows_of_pairs = self.has_rows_of_pairs(at);
        let settings = &SolverSettings { warm_start: guess != Guess::Zero, ..settings };
        let State { x: iterate, dv, .. } = &mut *self.next;
        let Evaluated { evaluation, numbers, scratches, .. } = &*self.evaluated;
        let groups = evaluation.rows.len();
        size(dv, groups);
        if settings.preconditioner == PreconditionerKind::Patches && interrupt.is_requested() {
            // They may not have been made.
            return SolveReport::at_once(Outcome::IterationCap, f64::NAN);
        }
        let (own, of_contact) = (model.share.own(), &self.contact.rows);
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
            of_contact.keep_off(model, dv);
        };

        let x = if at.is_iterate() { &*iterate } else { &state.x };
        let pairs = Some(of_contact).filter(|rows| has_rows_of_pairs && !rows.is_empty());
        let matrix = StepMatrix::new((model, numbers), x, evaluation, scratches, interrupt).with(pairs);
        let (b, inverse) = match pairs {
            Some(rows) => (&rows.b[..], &rows.inverse[..]),
            None if has_rows_of_pairs => (of_contact.kept(), &evaluation.inverse[..]),
            None => (&evaluation.rows[..], &evaluation.inverse[..]),
        };
        self.solver.solve(&Linear { matrix, b, inverse }, dv, &begin, settings)
    }

    /// Adds the common part to a change of velocity that was solved for.
    fn give_back(&mut self, common: Option<&CommonPart<R>>) {
        if let Some(common) = common {
            common.add(self.model, &mut self.next.dv);
            self.solver.cg.lower(common.descent);
        }
        self.watch.lap(Stage::Solve);
    }
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

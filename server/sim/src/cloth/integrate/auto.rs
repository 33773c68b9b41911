//! One linear solve where it is enough, and Newton's method from there where it is not: where forces change so much within the step that
//! what is minimised falls less than the solve promised.
//!
//! The fall and its promise come with what judges the step, so that a step which one solve is enough for costs nothing more and has the bits
//! of [`super::one_step`]. A solve is enough where the fall lacks no more than a share of the energy that moves and is stretched:
//! both are the same from wherever the scene is seen. A fall that is more than promised is that of springs under compression, which
//! the tangent of one solve holds stiffer than they are, so that it ends before the minimum and not beyond it. The exact tangents of the solves
//! after it err to both sides, and both count.

use super::{
    iterate::Start,
    mix::Mix,
    newton::{Iterate, Search, Tried},
    update::Step,
    vectors::Vectors,
};
use crate::{
    cloth::{
        evaluate::Evaluated,
        judge::{Found, moving, risen_most},
        settings::ClothSettings,
    },
    interrupt::Interrupt,
    linalg::{Outcome, SolveReport},
    math::Real,
    report::{Stage, StepFailure},
};

/// Linear solves of a sub-step, at most.
const SOLVES: u32 = 4;

/// Goes on from where one linear solve from the state led; returns what [`super::newton::advance`] does.
pub(super) fn go_on<R: Real>(
    step: &mut Step<'_, R>,
    settings: &ClothSettings,
    interrupt: &Interrupt,
    (report, found): (SolveReport, Found),
    accuracy: f64,
) -> Result<(SolveReport, Found, f64), StepFailure> {
    let inertia = step.return_to_solution(found);
    let mut search = Search { step, settings, interrupt, report: Some(report), mix: Mix::EXACT, taken: 0.0 };
    let first = search.evaluate(Tried::Next);
    let last = search.go_on(first, accuracy)?;
    Ok(search.end(inertia, [first, last], Outcome::Converged))
}

impl<R: Real> Step<'_, R> {
    /// Puts what was solved for where iterates are, in the air that the solve was made in; returns the inertia of the start of the step, in
    /// the sense of `Leftover`.
    fn return_to_solution(&mut self, found: Found) -> f64 {
        let Evaluated { numbers, scratches, .. } = &mut *self.evaluated;
        let Vectors { trial: [x, v], inertias, .. } = &mut *self.vectors;
        let next = &mut *self.next;
        numbers.external.freeze_air(self.model, [&self.state.x, &self.state.v], scratches);
        if found != Found::End {
            std::mem::swap(&mut next.x, x);
            std::mem::swap(&mut next.v, v);
        }
        let inertia = Start::new(self.model, self.state, numbers).predict([x, v], inertias);
        self.watch.lap(Stage::Position);
        inertia
    }
}

impl<R: Real> Search<'_, '_, R> {
    /// Goes on from the iterate in `next`, which was evaluated, to the first that a whole change led to which did what its solve promised.
    ///
    /// # Errors
    /// Where no change does within so many solves, those before it counted.
    pub(super) fn go_on(&mut self, first: Iterate, accuracy: f64) -> Result<Iterate, StepFailure> {
        let (mut now, mut missed) = (first, [0.0; 2]);
        for _ in u32::from(self.report.is_some())..SOLVES {
            // What is not finite shows in the diagnostics of where the step leads.
            if !now.value().is_finite() {
                return Ok(now);
            }
            let is_alone = self.report.is_none();
            self.solve_again()?;
            let (promised, slack) = (self.step.solver.cg.descent(), self.slack(&now));
            // Rounding hides whether it falls.
            let Some(new) = self.search(&now)? else { return Ok(now) };
            let lacks = promised - (now.value() - new.value_on_the_way());
            let limit = accuracy * self.moving(&new) + slack;
            missed = [if is_alone { lacks } else { lacks.abs() }, limit];
            now = new;
            if self.taken == 1.0 && missed[0] <= missed[1] {
                return Ok(now);
            }
        }
        let Step { model, state, next, evaluated, .. } = &*self.step;
        let particle = risen_most(model, &evaluated.numbers, [state, next]);
        let [value, limit] = missed;
        Err(StepFailure::Missed { particle, value, limit, solves: SOLVES })
    }

    /// What moves and is stretched at the start of the step or at an iterate (J): see [`moving`].
    fn moving(&self, iterate: &Iterate) -> f64 {
        moving([self.step.start, &iterate.total], self.step.common)
    }
}

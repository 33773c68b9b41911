//! An implicit Euler step that keeps surfaces apart: solves with the pairs that push, until a certificate holds for each pair.
//!
//! What it starts from and what it minimises are those of [`super::one_step`], with the energy of the pairs (docs/laws/surfaces.md).

use super::{at::At, solve::check, update::Step};
use crate::{
    cloth::{
        contact::{ROUNDS, Review, Scene},
        judge::Found,
        layout::Surface,
        settings::ClothSettings,
    },
    linalg::{Outcome, SolveReport},
    math::Real,
    report::{Stage, StepFailure},
    surroundings::Surroundings,
};

/// Writes where the step leads; returns its solves, what they found, and what the error of a particle is of the vector that its
/// block added up.
pub(super) fn advance<R: Real>(
    step: &mut Step<'_, R>,
    settings: &ClothSettings,
    surface: &Surface,
    around: &Surroundings<'_>,
) -> Result<(SolveReport, Found, f64), StepFailure> {
    let scene = Scene {
        model: step.model,
        surface,
        colliders: around.colliders,
        state: step.state,
        // What slept is expected to stay: in a long step it would fall far.
        before: if settings.solver.warm_start || around.steps > 1.0 { &step.state.dv } else { &[] },
        sub_step: step.evaluated.numbers.sub_step,
        steps: around.steps,
        gravity: step.evaluated.numbers.gravity.map(R::to_f64),
        friction: settings.contact.friction,
        recovery: settings.contact.recovery,
        interrupt: around.interrupt,
    };
    step.contact.begin(scene, &step.evaluated.evaluation.rows)?;
    step.watch.lap(Stage::Collide);

    let mut told: Option<SolveReport> = None;
    for round in 0..ROUNDS {
        step.contact.set(scene, &step.evaluated.evaluation.inverse);
        step.watch.lap(Stage::Collide);
        let report = step.solve(At::Round(round), settings, around.interrupt);
        if around.interrupt.is_requested() {
            return Err(StepFailure::Interrupted);
        }
        let report = told.map_or(report, |before| before.and(report));
        if matches!(report.outcome, Outcome::NotFinite { iteration: 0 }) && !step.has_finite_forces() {
            step.show_forces();
            step.kick_by_dv_and_drift();
            return Ok((report, Found::End, step.error_of_change()));
        }
        check(&report)?;
        told = Some(report);
        step.balance_change();
        step.kick_by_dv_and_drift();
        if !step.has_finite_ends() {
            return Ok((report, Found::End, step.error_of_change()));
        }
        let review = step.contact.review(scene, step.next, step.contacts, round)?;
        step.watch.lap(Stage::Collide);
        if review == Review::Safe {
            return Ok((report, Found::End, step.error_of_change()));
        }
    }
    Err(step.contact.failure(step.model))
}

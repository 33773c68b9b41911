//! Integrators, one file each; definitions in docs/laws/integrators.md.
//!
//! Each reads a model, a state and its evaluation, writes the state one step later, and says what its error is of the
//! vectors that it added up. h = dt;
//! a(x, v) = (springs + drag) / m + g, 0 for pins, whose velocity is prescribed.

mod vectors;
mod solver;
mod update;
mod explicit_euler;
mod symplectic_euler;
mod velocity_verlet;
mod common_part;
mod mix;
mod at;
mod set_up;
mod solve;
mod iterate;
mod balance;
mod one_step;
mod with_contact;
mod newton;
mod auto;
mod saddle;
mod common_motion;
mod momentum;
mod vertex_block_descent;
mod tasks;
#[cfg(test)]
mod tests;

pub(super) use solver::Solver;
pub(super) use tasks::{accelerate, drift, kick, solve_once};
pub(super) use update::Step;
pub(super) use vectors::Vectors;

use super::{
    evaluate::Motion,
    judge::Found,
    settings::{ClothSettings, Integrator, Minimizer},
};
use crate::{
    interrupt::Interrupt, linalg::SolveReport, math::Real, report::StepFailure, surroundings::Surroundings,
};

/// What a sub-step that is tried tells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Advanced {
    /// Of an implicit step: its linear solves as one, and where they led.
    pub(super) solve: Option<(SolveReport, Found)>,
    pub(super) motion: Motion,
}

/// Writes where a step leads, from a state that was evaluated. What was known of that is then used up.
pub(super) fn advance<R: Real>(
    step: &mut Step<'_, R>,
    settings: &ClothSettings,
    around: &Surroundings<'_>,
) -> Result<Advanced, StepFailure> {
    let interrupt = around.interrupt;
    if interrupt.is_requested() {
        return Err(StepFailure::Interrupted);
    }

    step.evaluated.forget();
    step.solver.forget();
    let mut solve = None;
    let scale = match settings.integrator {
        Integrator::ExplicitEuler => explicit_euler::advance(step),
        Integrator::SymplecticEuler => symplectic_euler::advance(step),
        Integrator::VelocityVerlet => velocity_verlet::advance(step),
        Integrator::VelocityVerletPredicted => velocity_verlet::advance_predicted(step),
        Integrator::ImplicitEuler | Integrator::ImplicitMidpoint | Integrator::Bdf2 => {
            let (report, found, scale) = match (settings.minimizer, step.model.thick_surface()) {
                (Minimizer::VertexBlockDescent { sweeps }, _) => {
                    vertex_block_descent::advance(step, settings, sweeps, interrupt)?
                }
                (_, Some(surface)) if settings.solves_from_state() => {
                    with_contact::advance(step, settings, surface, around)?
                }
                _ if settings.solves_from_state() => one_step::advance(step, settings, interrupt)?,
                _ => newton::advance(step, settings, interrupt)?,
            };
            solve = Some((report, found));
            scale
        }
    };

    Ok(Advanced { solve, motion: step.motion(scale) })
}

/// Goes on from where one linear solve led, and writes the state where that leads: see [`advance`]. `found` is what the solve found, and
/// `accuracy` how much of what moves and is stretched a fall may lack.
pub(super) fn go_on<R: Real>(
    step: &mut Step<'_, R>,
    settings: &ClothSettings,
    interrupt: &Interrupt,
    found: (SolveReport, Found),
    accuracy: f64,
) -> Result<Advanced, StepFailure> {
    step.evaluated.forget();
    let (report, found, scale) = auto::go_on(step, settings, interrupt, found, accuracy)?;
    Ok(Advanced { solve: Some((report, found)), motion: step.motion(scale) })
}

//! Integrators, one file each; definitions in docs/laws/integrators.md.
//!
//! Each reads a model, a state and its evaluation, writes the state one step later, and says what its error is of the
//! vectors that it added up. h = dt;
//! a(x, v) = (springs + drag) / m + g, 0 for pins, whose velocity is prescribed.

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
#[cfg(test)]
mod tests;

use update::Step;

use super::{
    evaluate::{Motion, Workspace},
    judge::Found,
    layout::Model,
    settings::{ClothSettings, Integrator, Minimizer},
    state::State,
};
use crate::{
    interrupt::Interrupt,
    linalg::SolveReport,
    math::Real,
    report::{StepFailure, Stopwatch},
    surroundings::Surroundings,
};

/// What a sub-step that is tried tells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Advanced {
    /// Of an implicit step: its linear solves as one, and where they led.
    pub(super) solve: Option<(SolveReport, Found)>,
    pub(super) motion: Motion,
}

/// Writes the state at a time (s), one time step after `state`, which was evaluated, into the workspace's `next`. What was known of
/// `state` is then used up.
pub(super) fn advance<R: Real>(
    model: &Model<R>,
    settings: &ClothSettings,
    (around, end): (&Surroundings<'_>, f64),
    state: &State<R>,
    work: &mut Workspace<R>,
    watch: &mut dyn Stopwatch,
) -> Result<Advanced, StepFailure> {
    let interrupt = around.interrupt;
    if interrupt.is_requested() {
        return Err(StepFailure::Interrupted);
    }

    work.forget();
    let mut step = Step { model, state, work, watch };
    let mut solve = None;
    let scale = match settings.integrator {
        Integrator::ExplicitEuler => explicit_euler::advance(&mut step),
        Integrator::SymplecticEuler => symplectic_euler::advance(&mut step),
        Integrator::VelocityVerlet => velocity_verlet::advance(&mut step),
        Integrator::VelocityVerletPredicted => velocity_verlet::advance_predicted(&mut step),
        Integrator::ImplicitEuler | Integrator::ImplicitMidpoint | Integrator::Bdf2 => {
            let (report, found, scale) = match (settings.minimizer, model.thick_surface()) {
                (Minimizer::VertexBlockDescent { sweeps }, _) => {
                    vertex_block_descent::advance(&mut step, settings, sweeps, interrupt)?
                }
                (_, Some(surface)) if settings.solves_from_state() => {
                    with_contact::advance(&mut step, settings, surface, (around, end))?
                }
                _ if settings.solves_from_state() => one_step::advance(&mut step, settings, interrupt)?,
                _ => newton::advance(&mut step, settings, interrupt)?,
            };
            solve = Some((report, found));
            scale
        }
    };

    Ok(Advanced { solve, motion: Motion::of(&model.share, &work.moved, model.free_count, scale) })
}

/// Goes on from where one linear solve led, and writes the state where that leads: see [`advance`]. `found` is what the solve found, and
/// `accuracy` how much of what moves and is stretched a fall may lack.
pub(super) fn go_on<R: Real>(
    (model, settings): (&Model<R>, &ClothSettings),
    interrupt: &Interrupt,
    state: &State<R>,
    work: &mut Workspace<R>,
    watch: &mut dyn Stopwatch,
    found: (SolveReport, Found),
    accuracy: f64,
) -> Result<Advanced, StepFailure> {
    work.know_nothing();
    let mut step = Step { model, state, work, watch };
    let (report, found, scale) = auto::go_on(&mut step, settings, interrupt, found, accuracy)?;
    let motion = Motion::of(&model.share, &work.moved, model.free_count, scale);
    Ok(Advanced { solve: Some((report, found)), motion })
}

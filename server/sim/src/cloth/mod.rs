//! Cloth: particles joined by springs. [`step`] takes the stages in order.

mod continuations;
mod network;
mod integrator;
mod settings;
mod sell;
mod model;
mod state;
mod forces;
mod step_operator;
mod integrate;
mod diagnose;

pub use forces::{spring_force, spring_jacobian_v, spring_jacobian_x};
pub use integrator::Integrator;
pub use model::{LawEntry, Model, Parameters};
pub use network::{Network, Spring, SpringKind, SpringLaw, SpringRules};
pub use sell::Sell;
pub use settings::{ClothSettings, Hessian, StateLimits};
pub use state::{PathPoint, PinMotion, State, Workspace};

use crate::{
    collide::{Contacts, resolve},
    linalg::SolveReport,
    math::Real,
    report::{Diagnostics, Stage, StepFailure, Stopwatch},
    surroundings::Surroundings,
};

/// What one step of a cloth reports.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClothReport {
    /// Diagnostics of the new state.
    pub diagnostics: Diagnostics,
    /// Particles that touched a collider in the last sub-step.
    pub contact_count: u64,
    /// The last linear solve.
    pub solve: Option<SolveReport>,
}

/// Advances a cloth by one step of the world.
///
/// # Errors
/// When the solver finds its matrix singular, or the new state is not finite or leaves the
/// settings' limits. `state` is then not the one before: the caller kept that.
pub fn step<R: Real>(
    model: &Model<R>,
    parameters: &Parameters,
    settings: &ClothSettings,
    around: &Surroundings<'_>,
    state: &mut State<R>,
    work: &mut Workspace<R>,
    watch: &mut dyn Stopwatch,
) -> Result<ClothReport, StepFailure> {
    work.size_for(model, settings.integrator);
    work.frozen.refresh(parameters, around, settings.substeps);
    let dt = work.frozen.dt;

    let mut report = ClothReport::default();
    for substep in 1..=settings.substeps {
        state.aim_pins(dt);
        report.solve = integrate::advance(model, settings, around.interrupt, state, work, watch)?;
        let time = around.time + dt * f64::from(substep);
        let contacts = Contacts { colliders: around.colliders, time, dt, block_size: model.block_size };
        report.contact_count = resolve(contacts, &model.inv_m, &mut state.x, &mut state.v);
        watch.lap(Stage::Collide);
        state.rest_pins();
    }

    report.diagnostics = diagnose::diagnose(model, state, work);
    let failure = diagnose::judge(model, state, &report.diagnostics, settings);
    watch.lap(Stage::Diagnose);
    failure.map_or(Ok(report), Err)
}

/// Diagnostics of a state as it is.
pub fn diagnose<R: Real>(
    model: &Model<R>,
    parameters: &Parameters,
    around: &Surroundings<'_>,
    state: &State<R>,
) -> Diagnostics {
    let mut work = Workspace::new();
    work.size_for(model, Integrator::ExplicitEuler);
    work.frozen.refresh(parameters, around, 1);
    diagnose::diagnose(model, state, &mut work)
}

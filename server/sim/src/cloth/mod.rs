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
mod bound;

pub(crate) use bound::{Bound, step_bound};
pub use forces::{spring_force, spring_jacobian_v, spring_jacobian_x};
pub use integrator::Integrator;
pub use model::{LawEntry, Model, Parameters};
pub use network::{Network, Spring, SpringKind, SpringLaw, SpringRules};
pub use sell::Sell;
pub use settings::{ClothSettings, Hessian, StateLimits};
pub use state::{PathPoint, PinMotion, State, Workspace};

use crate::{
    collide::{Contacts, Met, resolve},
    linalg::SolveReport,
    math::Real,
    report::{Diagnostics, Notices, Stage, StepFailure, Stopwatch},
    surroundings::Surroundings,
};

/// What one step of a cloth reports.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClothReport {
    /// Diagnostics of the new state.
    pub diagnostics: Diagnostics,
    /// Particles that touched a collider, each once per sub-step in which it did.
    pub contact_count: u64,
    /// The linear solve with the largest residual of all sub-steps, with the iterations of all.
    pub solve: Option<SolveReport>,
    /// What the user should know; particles in the user's numbering of the body.
    pub notices: Notices,
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
        let solve = integrate::advance(model, settings, around.interrupt, state, work, watch)?;
        report.solve = solve.map(|solve| report.solve.map_or(solve, |others| others.and(solve)));
        let time = around.time + dt * f64::from(substep);
        let (colliders, block_size, user) = (around.colliders, model.block_size, &model.user);
        let contacts = Contacts { colliders, time, dt, block_size, user };
        let met = resolve(contacts, &model.inv_m, &mut state.x, &mut state.v);
        report.contact_count += met.touched;
        report.notices = report.notices.and(notices(settings, solve.as_ref(), met));
        watch.lap(Stage::Collide);
        state.rest_pins();
    }

    report.diagnostics = diagnose::diagnose(model, state, work);
    let failure = diagnose::judge(model, state, &report.diagnostics, settings);
    watch.lap(Stage::Diagnose);
    failure.map_or(Ok(report), Err)
}

/// What a sub-step's solve and contacts have to tell.
fn notices(settings: &ClothSettings, solve: Option<&SolveReport>, met: Met) -> Notices {
    let first_passed = met.first_passed.map(u64::from);
    let mut notices = Notices { passed_count: met.passed, first_passed, ..Notices::default() };
    if let Some(solve) = solve {
        notices.count(solve.outcome, settings.solver.stop);
    }
    notices
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

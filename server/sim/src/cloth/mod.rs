//! Cloth: particles joined by springs. [`step`] takes the stages in order.

mod integrator;
mod settings;
mod laws;
mod continuations;
mod network;
mod halo;
mod rows;
mod scratch;
mod elements;
mod model;
mod numbers;
mod evaluation;
mod step_matrix;
mod state;
mod workspace;
mod coarse;
mod integrate;
mod judge;
mod bound;

pub(crate) use bound::{Bound, step_bound};
pub use integrator::Integrator;
pub use laws::{ElementKind, spring_force, spring_jacobian_v, spring_jacobian_x};
pub use model::{LawEntry, Model, Parameters};
pub use network::{ElementList, Network, Spring, SpringKind, SpringLaw, SpringRules};
pub use rows::Springs;
pub use settings::{ClothSettings, Hessian, StateLimits};
pub use state::{PathPoint, PinMotion, State};
pub use workspace::Workspace;

use evaluation::Purpose;

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
/// settings' limits. [`Workspace`] then holds the state before the step.
///
/// # Panics
/// If the settings ask for a preconditioner with a coarse space and those that the model was made for do not.
pub fn step<R: Real>(
    model: &Model<R>,
    parameters: &Parameters,
    settings: &ClothSettings,
    around: &Surroundings<'_>,
    state: &mut State<R>,
    work: &mut Workspace<R>,
    watch: &mut dyn Stopwatch,
) -> Result<ClothReport, StepFailure> {
    let purpose = Purpose::of(settings);
    work.size_for(model, settings, purpose);
    if work.numbers.refresh(model, parameters, settings, around) {
        work.forget();
    }
    let dt = work.numbers.dt;
    work.begin(state);

    let mut report = ClothReport::default();
    for substep in 1..=settings.substeps {
        if state.aim_pins(dt) {
            work.forget();
        }
        if !work.is_current(purpose) {
            work.evaluate(model, purpose, state);
            watch.lap(Stage::Force);
        }

        work.make_room(state, settings.substeps);
        let solve = integrate::advance(model, settings, around.interrupt, state, work, watch)?;
        work.accept(state);
        report.solve = solve.map(|solve| report.solve.map_or(solve, |others| others.and(solve)));

        let time = around.time + dt * f64::from(substep);
        let (colliders, block_size, user) = (around.colliders, model.block_size, &model.user);
        let contacts = Contacts { colliders, time, dt, block_size, user };
        let met = resolve(contacts, &model.inv_m, &mut state.x, &mut state.v);
        report.contact_count += met.touched;
        report.notices = report.notices.and(notices(settings, solve.as_ref(), met));
        watch.lap(Stage::Collide);

        state.rest_pins();
        work.evaluate(model, purpose, state);
        watch.lap(Stage::Force);
    }

    report.diagnostics = work.evaluation.diagnostics;
    let failure = judge::judge(model, state, &report.diagnostics, settings);
    watch.lap(Stage::Force);
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
    settings: &ClothSettings,
    around: &Surroundings<'_>,
    state: &State<R>,
) -> Diagnostics {
    let mut work = Workspace::new();
    work.size_for(model, settings, Purpose::Explicit);
    work.numbers.refresh(model, parameters, settings, around);
    work.evaluate(model, Purpose::Explicit, state);
    work.evaluation.diagnostics
}

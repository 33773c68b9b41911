//! Cloth: particles joined by springs. `step` takes the stages of a sub-step in order.

mod settings;
mod laws;
mod network;
mod layout;
mod rest;
mod state;
mod contact;
mod evaluate;
mod judge;
mod integrate;
mod step;

pub use laws::{Air, Bending, ElementKind, spring_force, spring_jacobian_v, spring_jacobian_x};
pub(crate) use layout::check_network;
pub use layout::{LawEntry, Model, Parameters, Springs};
pub use network::{Crossed, ElementList, Network, Spring, SpringKind, SpringLaw, SpringRules};
pub(crate) use network::{Joined, resolve};
pub(crate) use rest::{Watch, check_rest};
pub use settings::{
    ClothSettings, Hessian, Integrator, Minimizer, MinimizerKind, NewtonSettings, OnPass, RestSettings,
    StateLimits, SurfaceCheck, SurfaceSettings,
};
pub(crate) use state::{ClothReport, Gain};
pub use state::{PathPoint, PinMotion, State};
pub(crate) use step::{StepMemory, Stepping};

use evaluate::{Evaluated, Evaluation};
use settings::Purpose;

use crate::{
    math::Real,
    report::{BoundKind, Diagnostics},
    surroundings::Surroundings,
};

/// Diagnostics of a state as it is.
pub fn diagnose<R: Real>(
    model: &Model<R>,
    parameters: &Parameters,
    settings: &ClothSettings,
    around: &Surroundings<'_>,
    state: &State<R>,
) -> Diagnostics {
    evaluate(model, parameters, settings, around, state, Purpose::Explicit).diagnostics()
}

/// The longest step (s) that is stable for small motions about a state, of velocity Verlet where the settings ask for it, of
/// symplectic Euler otherwise, and the particle that sets it, in the user's numbering; infinite where nothing acts on any
/// free particle.
pub(crate) fn step_bound<R: Real>(
    model: &Model<R>,
    parameters: &Parameters,
    settings: &ClothSettings,
    around: &Surroundings<'_>,
    state: &State<R>,
) -> (f64, u32) {
    let integrator = match settings.integrator {
        verlet @ (Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted) => verlet,
        _ => Integrator::SymplecticEuler,
    };
    let settings = ClothSettings { integrator, ..*settings };
    let purpose = Purpose::Bounded(BoundKind::Stiffness);
    let bound = evaluate(model, parameters, &settings, around, state, purpose).bound;
    (1.0 / bound.rate, model.user[bound.particle as usize])
}

fn evaluate<R: Real>(
    model: &Model<R>,
    parameters: &Parameters,
    settings: &ClothSettings,
    around: &Surroundings<'_>,
    state: &State<R>,
    purpose: Purpose,
) -> Evaluation<R> {
    let mut evaluated = Evaluated::default();
    evaluated.size_for(model, purpose);
    evaluated.numbers.refresh(model, parameters, settings, around, (around.whole(), 0.0));
    let Evaluated { mut evaluation, mut numbers, scratches, .. } = evaluated;
    numbers.freeze_air(model, [&state.x, &state.v], &scratches);
    evaluation.look(model, &numbers, purpose, [&state.x, &state.v], &scratches);
    evaluation
}

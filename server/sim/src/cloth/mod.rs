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

pub use contact::wall_bytes;
pub(crate) use judge::bounding_law;
pub use laws::{
    Air, Bending, ElementKind, Threads, Warp, WarpError, spring_force, spring_jacobian_v, spring_jacobian_x,
};
pub(crate) use layout::check_network;
pub use layout::{LawEntry, Model, Parameters, Springs};
pub use network::{
    Crossed, ElementList, FIRMNESS, Frames, Network, Repeat, Spring, SpringKind, SpringLaw, SpringRules,
};
pub(crate) use network::{Joined, resolve};
pub(crate) use rest::{Long, Watch, check_rest};
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
    field::Field,
    math::{Real, Sixteen},
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
    evaluate(model, parameters, settings, around, state, std::iter::empty(), Purpose::Explicit).diagnostics()
}

/// What is evaluated of each particle at a state, sixteen at a time in the model's order: the force (N), also on pins, of springs, elements,
/// gravity, drag, the air, and forces that are `given` (N) by the user's numbers of particles, contact left out; or the acceleration (m/s²)
/// that follows from it, as explicit steps have it, 0 for pins.
pub(crate) fn evaluated<R: Real>(
    field: Field,
    model: &Model<R>,
    parameters: &Parameters,
    settings: &ClothSettings,
    around: &Surroundings<'_>,
    state: &State<R>,
    given: impl Iterator<Item = (u32, [f64; 3])>,
) -> Vec<Sixteen<R>> {
    let purpose = if field == Field::Forces { Purpose::Resultant } else { Purpose::Explicit };
    // Steps that divide forces by masses: of others, elements are evaluated times the length of a step.
    let settings = ClothSettings { integrator: Integrator::SymplecticEuler, ..*settings };
    evaluate(model, parameters, &settings, around, state, given, purpose).rows
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
    let given = std::iter::empty();
    let bound = evaluate(model, parameters, &settings, around, state, given, purpose).bound;
    (1.0 / bound.rate, model.user[bound.particle as usize])
}

/// Evaluates a state with forces (N) that are given by the user's numbers of particles.
fn evaluate<R: Real>(
    model: &Model<R>,
    parameters: &Parameters,
    settings: &ClothSettings,
    around: &Surroundings<'_>,
    state: &State<R>,
    given: impl Iterator<Item = (u32, [f64; 3])>,
    purpose: Purpose,
) -> Evaluation<R> {
    let mut evaluated = Evaluated::default();
    evaluated.size_for(model, purpose);
    evaluated.set_forces(model, given);
    evaluated.numbers.refresh(model, parameters, settings, around, (around.whole(), 0.0));
    let Evaluated { mut evaluation, mut numbers, scratches, .. } = evaluated;
    numbers.external.freeze_air(model, [&state.x, &state.v], &scratches);
    evaluation.look(model, &numbers, purpose, [&state.x, &state.v], &scratches);
    evaluation
}

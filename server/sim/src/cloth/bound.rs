//! The largest explicit step of a cloth: from the stiffness and damping of the springs at each particle, no eigenvalue
//! of the whole needed.

use nalgebra::SymmetricEigen;

use super::{
    model::{Model, Parameters},
    state::State,
};
use crate::math::{Mat3, Real};

/// A bound on the step, and the particle that sets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bound {
    /// Symplectic Euler and velocity Verlet are stable below it for small motions about the state (s); infinite where
    /// nothing acts on any free particle.
    pub(crate) dt: f64,
    /// In the user's numbering of the body.
    pub(crate) particle: u32,
}

/// The bound at a state.
///
/// A mode with stiffness w² and damping c, both per mass, is stable under symplectic Euler for h² w² + 2 h c <= 4
/// (velocity Verlet allows more). Each is at most the largest over particles i of what springs do there: (n.(a - b))²
/// <= 2 (n.a)² + 2 (n.b)² gives w² <= 2 lambda_max(K_i) / m_i and c <= (2 lambda_max(C_i) + drag) / m_i, with K_i and
/// C_i the sums of k (u uᵀ + g (I - u uᵀ)), g = max(0, 1 - l0/l), and of nu u uᵀ. So h solves
///
///   h² 2 lambda_max(K_i) + 2 h (2 lambda_max(C_i) + drag) = 4 m_i.
///
/// Elements add their shares, times their stiffness and damping, to 2 lambda_max(K_i) and 2 lambda_max(C_i).
pub(crate) fn step_bound<R: Real>(model: &Model<R>, parameters: &Parameters, state: &State<R>) -> Bound {
    let mut bound = Bound { dt: f64::INFINITY, particle: 0 };
    let elements = shares(model, parameters);
    for (user, &place) in model.place.iter().enumerate() {
        let i = place as usize;
        if model.inv_m[i] == R::zero() {
            continue;
        }
        let [stiffness, damping] = at(model, parameters, state, i);
        let [more_stiffness, more_damping] = elements.get(i).copied().unwrap_or_default();
        let (m, stiffness) = (model.m[i].to_f64(), 2.0 * stiffness + more_stiffness);
        let damping = 2.0 * damping + more_damping + parameters.drag;
        let dt = 4.0 * m / (damping + (damping * damping + 4.0 * stiffness * m).sqrt());
        if dt < bound.dt {
            bound = Bound { dt, particle: user as u32 };
        }
    }
    bound
}

/// What elements add to the stiffness (N/m) and the damping (N s/m) of each particle; empty without elements.
fn shares<R: Real>(model: &Model<R>, parameters: &Parameters) -> Vec<[f64; 2]> {
    let mut total = vec![[0.0; 2]; if model.elements.is_empty() { 0 } else { model.count }];
    for (elements, law) in model.elements.iter().zip(&parameters.elements) {
        let mut shares = vec![0.0; model.count];
        elements.add_shares(&mut shares);
        for ([stiffness, damping], share) in total.iter_mut().zip(shares) {
            *stiffness += law.stiffness * share;
            *damping += law.damping * share;
        }
    }
    total
}

/// Largest eigenvalues of the stiffness (N/m) and the damping (N s/m) of the springs at particle `i`.
fn at<R: Real>(model: &Model<R>, parameters: &Parameters, state: &State<R>, i: usize) -> [f64; 2] {
    let (mut elastic, mut viscous) = (Mat3::<f64>::zeros(), Mat3::<f64>::zeros());
    for spring in model.springs.row(i) {
        let law = parameters.laws[spring.law as usize].law;
        let d = (state.x[i].vector() - state.x[spring.other as usize].vector()).map(R::to_f64);
        let length = d.norm();
        if length > 0.0 {
            let across = (1.0 - spring.rest_length.to_f64() / length).max(0.0);
            let along = d * d.transpose() / (length * length);
            elastic += (along * (1.0 - across) + Mat3::identity() * across) * law.stiffness;
            viscous += along * law.damping;
        } else {
            elastic += Mat3::identity() * law.stiffness;
            viscous += Mat3::identity() * law.damping;
        }
    }
    [elastic, viscous].map(|matrix| SymmetricEigen::new(matrix).eigenvalues.max())
}

//! Static equilibrium, reached by stepping: no solver of its own.
//!
//! An implicit step with the full Hessian is, as dt grows, one step of Newton's method on f(x) = 0.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    math::Precision,
};

use crate::{
    Method, Scene,
    scene::{advance, max_distance, positions},
};

/// A strip of length L that a load along its tip bends, without Poisson's ratio: P L² / (D b), and how far the tip comes back and goes
/// down, in tenths of the length (Sze, Liu and Lo 2004, table of the cantilever under end shear).
pub const END_SHEAR: [[f64; 3]; 5] =
    [[0.4, 0.103, 1.309], [1.2, 0.763, 3.488], [2.0, 1.604, 4.933], [2.8, 2.370, 5.855], [4.0, 3.286, 6.698]];

/// Positions (m) at which the body of `scene` rests. Steps of `settling_dt` (s) with the safe
/// Hessian come near, then long steps with the full one end at rounding.
pub fn equilibrium(scene: &Scene, settling_dt: f64, settling_count: u64) -> Vec<[f64; 3]> {
    let implicit = |hessian| Method::new(Integrator::ImplicitEuler, hessian);
    let mut near = Scene { dt: settling_dt, ..scene.clone() }.by(implicit(Hessian::Absolute));
    let mut simulation = near.simulate(Precision::F64);
    advance(&mut simulation, settling_count);
    near.network.x = positions(&simulation);
    near.network.v.fill([0.0; 3]);

    let mut newton = Scene { dt: 1e5, ..near }.by(implicit(Hessian::Full)).simulate(Precision::F64);
    let mut last = positions(&newton);
    for _ in 0..40 {
        advance(&mut newton, 1);
        let next = positions(&newton);
        let moved = max_distance(&last, &next);
        last = next;
        if moved < 1e-14 {
            break;
        }
    }

    last
}

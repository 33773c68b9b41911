//! The cloth that is timed: a square sheet with stretch, shear and bend springs, held at two
//! corners, that falls under its own weight.
//!
//! Reads a number of particles per side; writes a world ready to be built.

use nappe_sim::{
    cloth::{ClothSettings, Integrator, Network, SpringLaw, SpringRules},
    linalg::{SolverSettings, Stop},
    math::Precision,
    mesh::TriangleMesh,
    world::{BodySetup, WorldSetup},
};

use super::timings;
use crate::error::Result;

/// Distance between neighbours (m).
const SPACING: f64 = 0.01;
/// Mass of a particle (kg).
const MASS: f64 = 0.01;
/// Stiffness of every spring (N/m).
const STIFFNESS: f64 = 1000.0;
/// Damping of every spring (N s/m).
const DAMPING: f64 = 0.01;
/// Time step of the implicit runs (s).
pub(crate) const IMPLICIT_DT: f64 = 0.005;
/// Iterations of the conjugate gradient in a step, whatever the residual (Zara 2001).
pub(crate) const ITERATIONS: u32 = 10;
/// A sheet large enough to have particles with all twelve springs: they set the step bound.
const PROBE_SIDE: usize = 8;

/// Particles and springs of a square sheet.
pub(crate) fn network(side: usize) -> Network {
    let law = SpringLaw { stiffness: STIFFNESS, damping: DAMPING };
    let rules = SpringRules { stretch: law, shear: Some(law), bend: Some(law) };
    let mesh = TriangleMesh::grid(side, side, SPACING);
    let mut network = Network::from_lattice(&mesh, [side, side], &rules, MASS);
    network.pins = vec![0, side as u32 - 1];
    network
}

/// The world of such a sheet. Explicit integrators take half of their largest stable step.
///
/// # Errors
/// When the simulation refuses the sheet, which would be an error in this program.
pub(crate) fn world(network: &Network, integrator: Integrator) -> Result<WorldSetup> {
    let dt = if integrator.is_implicit() { IMPLICIT_DT } else { 0.5 * stable_step()? };
    Ok(setup(network.clone(), integrator, dt))
}

/// The largest stable explicit step of a sheet of these springs (s). It is the same for every size
/// above a few particles per side, so a small one is asked.
fn stable_step() -> Result<f64> {
    let probe = setup(network(PROBE_SIDE), Integrator::SymplecticEuler, IMPLICIT_DT);
    let simulation = timings::build(&probe, Precision::F64)?;
    Ok(simulation.step_bounds().iter().map(|bound| bound.dt).fold(f64::INFINITY, f64::min))
}

fn setup(network: Network, integrator: Integrator, dt: f64) -> WorldSetup {
    let solver = SolverSettings { stop: Stop::Iterations(ITERATIONS), ..SolverSettings::default() };
    let settings = ClothSettings { integrator, solver, ..ClothSettings::default() };
    WorldSetup {
        dt,
        gravity: [0.0, -9.81, 0.0],
        wind: [0.0; 3],
        colliders: Vec::new(),
        bodies: vec![BodySetup { name: "sheet".to_owned(), network, settings }],
        snow: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_of_side_n_has_the_springs_that_the_formula_counts() {
        let n = 20;
        let springs = network(n).springs.len();
        assert_eq!(springs, 2 * n * (n - 1) + 2 * (n - 1) * (n - 1) + 2 * n * (n - 2));
    }
}

//! The cloth that is timed: a square sheet that falls under its own weight. It has stretch, shear and bend springs,
//! and is held at two corners.
//!
//! Reads a number of particles per side; writes a world ready to be built.

use nappe_sim::{
    cloth::{ClothSettings, ElementKind, ElementList, Integrator, Network, SpringLaw, SpringRules},
    linalg::{SolverSettings, Stop},
    math::Precision,
    mesh::TriangleMesh,
    time_step::TimeStep,
    world::{BodySetup, WorldSetup},
};

use super::timings;
use crate::words::error::Result;

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

/// Bending stiffness of the sheet of a fabric (N m), and its damping (N m s).
const BENDING: SpringLaw = SpringLaw { stiffness: 1e-5, damping: 1e-7 };

/// The square sheet of that side with a membrane and a plate in place of springs.
pub(crate) fn membrane_plate(side: usize) -> Network {
    let mut network = network(side);
    network.springs.clear();
    let mesh = TriangleMesh::grid(side, side, SPACING);
    let law = SpringLaw { stiffness: STIFFNESS, damping: DAMPING };
    network.elements = vec![
        ElementList::new(ElementKind::Membrane, law, &mesh),
        ElementList::new(ElementKind::Plate, BENDING, &mesh),
    ];
    network
}

/// Shares of a cell by which a point of an irregular sheet leaves its place, at most.
const JITTER: f64 = 0.3;
/// Ends of springs that a particle inside a square sheet has, and an irregular one on average.
const ENDS: [f64; 2] = [12.0, 15.8];

/// An irregular sheet of about as many springs as a square one of that side: points off their places, diagonals of cells
/// in either direction, springs on edges, across pairs of triangles and along straight continuations.
pub(crate) fn irregular(side: usize) -> Network {
    let side = (side as f64 * (ENDS[0] / ENDS[1]).sqrt()).round() as usize;
    let mut mesh = TriangleMesh::grid(side, side, SPACING);
    for (i, point) in mesh.points.iter_mut().enumerate() {
        for (axis, salt) in [(0, 1), (2, 2)] {
            point[axis] += SPACING * JITTER * (2.0 * share(3 * i + salt) - 1.0);
        }
    }
    mesh.triangles = (0..(side - 1) * (side - 1))
        .flat_map(|cell| {
            let (row, column) = (cell / (side - 1), cell % (side - 1));
            let corner = |r: usize, c: usize| ((row + r) * side + column + c) as u32;
            let [a, b, c, d] = [corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)];
            if share(3 * cell) < 0.5 { [[a, c, b], [b, c, d]] } else { [[a, c, d], [a, d, b]] }
        })
        .collect();

    let law = SpringLaw { stiffness: STIFFNESS, damping: DAMPING };
    let rules = SpringRules { stretch: law, shear: Some(law), bend: Some(law) };
    let mut network = Network::from_mesh(&mesh, &rules, MASS);
    network.pins = vec![0, side as u32 - 1];
    network
}

/// Time step of the stiff sheet (s).
const STIFF_DT: f64 = 1.0 / 60.0;

/// A square metre of cloth of 0.2 kg whose springs are those of a membrane of 10 kN/m, in waves that leave none at rest:
/// the finer it is, the harder its step is to solve.
pub(crate) fn stiff(side: usize) -> Network {
    let spacing = 1.0 / (side - 1) as f64;
    let law = |length: f64| SpringLaw { stiffness: 1e4 * spacing / length, damping: 0.0 };
    let rules = SpringRules { stretch: law(1.0), shear: Some(law(2.0_f64.sqrt())), bend: Some(law(2.0)) };
    let mesh = TriangleMesh::grid(side, side, spacing);
    let mut network = Network::from_lattice(&mesh, [side, side], &rules, 0.2 / (side * side) as f64);
    for [x, y, z] in &mut network.x {
        *y = 0.02 * (7.0 * *x).sin() * (5.0 * *z).cos();
    }
    network.pins = vec![0, side as u32 - 1];
    network
}

/// Distance between neighbours of the rippled sheet (m), its mass (kg/m²), and the height of its ripples (m).
const RIPPLED_SPACING: f64 = 0.008;
const RIPPLED_DENSITY: f64 = 0.15;
const RIPPLE: f64 = 0.002;

/// A stiff sheet of so many columns and 13/15 as many rows, with ripples of two and a half columns, that hangs by two corners: it
/// folds along every ripple, at each end of which something else is stiff.
pub(crate) fn rippled(columns: usize) -> Network {
    let rows = columns * 13 / 15;
    let law = |stiffness: f64| SpringLaw { stiffness, damping: 0.0 };
    let rules = SpringRules { stretch: law(12e3), shear: Some(law(12e3)), bend: Some(law(300.0)) };
    let mut mesh = TriangleMesh::grid(columns, rows, RIPPLED_SPACING);
    for (i, point) in mesh.points.iter_mut().enumerate() {
        let [x, _, z] = *point;
        *point = [x, -z, RIPPLE * (-2.5 * (i % columns) as f64).sin()];
    }
    let mass = RIPPLED_DENSITY * RIPPLED_SPACING * RIPPLED_SPACING;
    let mut network = Network::from_lattice(&mesh, [columns, rows], &rules, mass);
    network.pins = vec![0, columns as u32 - 1];
    network
}

/// The world of a stiff sheet, stepped with this solver.
pub(crate) fn stiff_world(network: &Network, solver: SolverSettings) -> WorldSetup {
    world_of(network.clone(), ClothSettings { solver, ..ClothSettings::default() }, STIFF_DT)
}

/// A number of [0, 1), the same in every run.
fn share(i: usize) -> f64 {
    let hash = (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    ((hash ^ (hash >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 11) as f64 / (1_u64 << 53) as f64
}

/// The world of such a sheet. Explicit integrators take half of their largest stable step.
///
/// # Errors
/// When the simulation refuses the sheet, which would be an error in this program.
pub(crate) fn world(network: &Network, integrator: Integrator) -> Result<WorldSetup> {
    let dt = if integrator.is_implicit() { IMPLICIT_DT } else { 0.5 * stable_step()? };
    let mut setup = setup(network.clone(), integrator, dt);
    if integrator == Integrator::ExplicitEuler {
        // Undamped, none of its steps is stable: it is timed, not used.
        setup.bodies[0].settings.time_step = TimeStep::Unchecked(dt);
    }
    Ok(setup)
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
    world_of(network, ClothSettings { integrator, solver, ..ClothSettings::default() }, dt)
}

fn world_of(network: Network, settings: ClothSettings, dt: f64) -> WorldSetup {
    WorldSetup {
        dt,
        gravity: [0.0, -9.81, 0.0],
        wind_at: Vec::new(),
        wind: [0.0; 3],
        colliders: Vec::new(),
        bodies: vec![BodySetup { name: "sheet".to_owned(), network, settings, forces: Vec::new() }],
        snow: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_irregular_sheet_has_about_as_many_springs_as_a_square_one() {
        let (square, irregular) = (network(60).springs.len() as f64, irregular(60).springs.len() as f64);
        // Of small sheets, more particles lie on the border.
        assert!((irregular / square - 1.0).abs() < 0.1, "{irregular} and {square} springs");
    }

    #[test]
    fn a_sheet_of_a_fabric_has_both_laws_on_every_triangle() {
        let network = membrane_plate(9);
        let corners: Vec<usize> = network.elements.iter().map(ElementList::corner_count).collect();
        assert_eq!((network.springs.len(), corners), (0, vec![3 * 128, 6 * 128]));
    }

    #[test]
    fn a_sheet_of_side_n_has_the_springs_that_the_formula_counts() {
        let n = 20;
        let springs = network(n).springs.len();
        assert_eq!(springs, 2 * n * (n - 1) + 2 * (n - 1) * (n - 1) + 2 * n * (n - 2));
    }
}

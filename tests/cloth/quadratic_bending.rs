//! Elements of four particles: quadratic bending of pairs of triangles.

use nappe_sim::{
    cloth::{ElementKind, ElementList, Hessian, Integrator, Network, SpringLaw, SpringRules},
    linalg::{OperatorKind, Stop},
    math::Precision,
    mesh::TriangleMesh,
};
use nappe_tests::{
    Method, Scene,
    scene::{advance, positions, try_advance},
};

const BENDING: SpringLaw = SpringLaw { stiffness: 0.02, damping: 0.0 };

fn method(integrator: Integrator) -> Method {
    Method::new(integrator, Hessian::Absolute)
}

/// A grid of right triangles in the plane y = 0, with bending and no springs.
fn sheet([columns, rows]: [usize; 2], spacing: f64, law: SpringLaw) -> (Network, TriangleMesh) {
    let mesh = TriangleMesh::grid(columns, rows, spacing);
    let none = SpringRules { stretch: SpringLaw { stiffness: 0.0, damping: 0.0 }, shear: None, bend: None };
    let mut network = Network::from_lattice(&mesh, [columns, rows], &none, 1e-3);
    network.springs.clear();
    network.elements = vec![ElementList::new(ElementKind::QuadraticBending, law, &mesh)];
    (network, mesh)
}

#[test]
fn a_rolled_sheet_has_the_energy_of_its_curvature() {
    // Rolled along its rows, only edges across bend: each by the angle phi, with s² = 3 phi² on squares.
    let (columns, rows, spacing, radius) = (20, 7, 0.05, 1.5);
    let (mut network, _) = sheet([columns, rows], spacing, BENDING);
    let phi = 2.0 * (spacing / (2.0 * radius)).asin();
    for x in &mut network.x {
        let (column, z) = ((x[0] / spacing).round(), x[2]);
        let angle = phi * column;
        *x = [radius * angle.sin(), radius * (1.0 - angle.cos()), z];
    }
    let scene = Scene::new(network, 1e-3).by(method(Integrator::SymplecticEuler));
    let found = scene.simulate(Precision::F64).diagnose().elastic_energy;

    // K x of an edge is the second difference of its row, twice over: |e| times 2 sin(phi / 2) in the direction of the
    // normal, with the distance between rows as |e|. Triangles of a cell stay in a plane: diagonals do not bend.
    let second_difference = 2.0 * (phi / 2.0).sin();
    let edges = ((columns - 2) * (rows - 1)) as f64;
    let expected = edges * BENDING.stiffness * 0.5 * 3.0 * second_difference.powi(2);
    assert!((found / expected - 1.0).abs() < 1e-10, "{found} J, expected {expected} J");
}

#[test]
fn bending_changes_neither_momentum_nor_what_is_flat() {
    for integrator in Integrator::ALL {
        let law = SpringLaw { stiffness: 0.02, damping: 1e-4 };
        let (mut network, _) = sheet([17, 23], 0.05, law);
        for (i, v) in network.v.iter_mut().enumerate() {
            *v = [0.3, -0.2, 0.1 * (i as f64 * 0.7).sin()];
        }
        let mut scene = Scene::new(network, 1e-4).by(method(integrator));
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 500 };
        scene.settings.block_size = 32;
        let mut simulation = scene.simulate(Precision::F64);
        let before = simulation.diagnose();
        let after = advance(&mut simulation, 50).diagnostics;
        for c in 0..3 {
            assert!((before.momentum[c] - after.momentum[c]).abs() < 1e-13, "{integrator:?}: {after:?}");
        }
        assert!(after.elastic_energy > 0.0 && after.elastic_energy < before.kinetic_energy, "{after:?}");

        let (network, _) = sheet([17, 23], 0.05, law);
        let rest = network.x.clone();
        let mut still = Scene::new(network, 1e-4).by(method(integrator)).simulate(Precision::F64);
        advance(&mut still, 50);
        let moved = positions(&still)
            .iter()
            .zip(&rest)
            .map(|(x, rest)| (0..3).map(|c| (x[c] - rest[c]).abs()).fold(0.0, f64::max))
            .fold(0.0, f64::max);
        assert!(moved < 1e-14, "{integrator:?}: {moved} m");
    }
}

#[test]
fn an_implicit_step_is_the_same_with_the_matrix_stored() {
    let run = |operator: OperatorKind, block_size: usize| {
        let (mut network, mesh) = sheet([19, 21], 0.05, SpringLaw { stiffness: 0.02, damping: 1e-3 });
        let law = SpringLaw { stiffness: 50.0, damping: 0.01 };
        let rules = SpringRules { stretch: law, shear: Some(law), bend: None };
        network.springs = Network::from_mesh(&mesh, &rules, 1e-3).springs;
        network.pins = vec![0, 18];
        let mut scene = Scene::new(network, 5e-3).by(method(Integrator::ImplicitEuler));
        scene.settings.solver.operator = operator;
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 2000 };
        scene.settings.block_size = block_size;
        let mut simulation = scene.under([0.0, -9.81, 0.0]).simulate(Precision::F64);
        advance(&mut simulation, 40);
        positions(&simulation)
    };
    let free = run(OperatorKind::MatrixFree, 32);
    for other in [run(OperatorKind::Assembled, 32), run(OperatorKind::MatrixFree, 256)] {
        for (a, b) in free.iter().zip(&other) {
            assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-9), "{a:?}, {b:?}");
        }
    }
}

#[test]
fn an_explicit_step_is_stable_up_to_its_bound() {
    let gain = |share: f64| {
        let (mut network, _) = sheet([12, 12], 0.05, BENDING);
        for (i, v) in network.v.iter_mut().enumerate() {
            *v = [0.0, 1e-4 * (i as f64 * 1.3).sin(), 0.0];
        }
        let mut scene = Scene::new(network, 1.0).by(method(Integrator::SymplecticEuler));
        let bound = scene.simulate(Precision::F64).step_bounds()[0].dt;
        scene.dt = share * bound;
        let mut simulation = scene.simulate(Precision::F64);
        let before = simulation.diagnose().kinetic_energy;
        let mut most = 0.0;
        for _ in 0..2000 {
            let Ok(report) = try_advance(&mut simulation, 1) else { return f64::INFINITY };
            let now = report.diagnostics;
            most = f64::max(most, (now.kinetic_energy + now.elastic_energy) / before);
        }
        most
    };
    assert!(gain(0.99) < 50.0, "{}", gain(0.99));
    assert!(gain(2.0) > 1e6, "the bound is not far from the limit: {}", gain(2.0));
}

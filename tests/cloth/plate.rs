//! The law of a plate: elements of a triangle with its neighbours, against closed forms of plates and strips.

use nappe_sim::{
    cloth::{ElementKind, ElementList, Hessian, Integrator, Network, SpringLaw, SpringRules},
    linalg::{OperatorKind, Stop},
    math::{
        Precision,
        array::{cross, length, minus},
    },
    mesh::TriangleMesh,
};
use nappe_tests::{
    Method, Scene,
    flat::{Diagonals, grid, irregular, noise},
    golden::table,
    scene::{advance, positions, try_advance},
    statics::END_SHEAR,
};

use crate::strips::{CELL, Strip, hung};

const GRAVITY: f64 = 9.81;
/// Bending stiffness (N m), without damping.
const BENDING: SpringLaw = SpringLaw { stiffness: 0.02, damping: 0.0 };

/// Particles of a mesh with a law of elements and no springs, each of its third of the triangles around (kg, at 1 kg/m²).
fn sheet(mesh: &TriangleMesh, kind: ElementKind, law: SpringLaw) -> Network {
    let none = SpringRules { stretch: SpringLaw { stiffness: 0.0, damping: 0.0 }, shear: None, bend: None };
    let mut network = Network::from_mesh(mesh, &none, 0.0);
    network.springs.clear();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.points[corner as usize]);
        let third = length(cross(minus(b, a), minus(c, a))) / 6.0;
        for corner in triangle {
            network.masses[*corner as usize] += third;
        }
    }
    network.elements = vec![ElementList::new(kind, law, mesh)];
    network
}

fn by(integrator: Integrator) -> Method {
    Method::new(integrator, Hessian::Absolute)
}

#[test]
fn a_cell_within_a_sheet_has_the_energy_of_its_second_derivatives() {
    let spacing = 0.05;
    for [a, b, c] in [[0.3, 0.0, 0.0], [0.0, 0.0, 0.2], [0.0, 0.25, 0.0], [0.3, -0.1, -0.2]] {
        for diagonals in [Diagonals::OneWay, Diagonals::OtherWay] {
            let energy = |cells: [usize; 2], precision: Precision| {
                let mut network = sheet(&grid(cells, spacing, diagonals), ElementKind::Plate, BENDING);
                for [x, y, z] in &mut network.x {
                    *y = 0.5 * a * *x * *x + b * *x * *z + 0.5 * c * *z * *z;
                }
                Scene::new(network, 1e-3).simulate(precision).diagnose().elastic_energy
            };
            // What rims and corners have is the same for all of these.
            let [all, narrower, shorter, smaller] =
                [[9, 8], [8, 8], [9, 7], [8, 7]].map(|cells| energy(cells, Precision::F64));
            let cell = all - narrower - shorter + smaller;
            let square = a * a + 2.0 * b * b + c * c;
            let expected = 0.5 * BENDING.stiffness * square * spacing * spacing;
            assert!((cell / expected - 1.0).abs() < 1e-9, "{diagonals:?}: {cell} J, expected {expected} J");

            let single = energy([9, 8], Precision::F32);
            assert!((single / all - 1.0).abs() < 1e-3, "{single} J in f32, {all} J in f64");
        }
    }
}

/// Deflection of the middle of a square plate, supported around its rim, under its own weight, in that of a plate.
fn deflection(mesh: &TriangleMesh, cells: usize, kind: ElementKind, stiffness: f64) -> f64 {
    let mut network = sheet(mesh, kind, SpringLaw { stiffness, damping: 0.0 });
    let side = cells + 1;
    let is_at_rim = |point: &usize| {
        let (column, row) = (point % side, point / side);
        column == 0 || row == 0 || column == cells || row == cells
    };
    network.pins = (0..side * side).filter(is_at_rim).map(|point| point as u32).collect();
    // The energy is a quadratic form: one step that is long enough ends at rest.
    let mut scene = Scene::new(network, 1e3).by(by(Integrator::ImplicitEuler)).under([0.0, -1.0, 0.0]);
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-12, max_iterations: 20_000 };
    let mut simulation = scene.simulate(Precision::F64);
    advance(&mut simulation, 2);
    let across = mesh.points[cells][0] - mesh.points[0][0];
    -positions(&simulation)[side * (cells / 2) + cells / 2][1] * BENDING.stiffness
        / across.powi(4)
        / 0.004_062_35
}

#[test]
fn a_square_plate_that_is_supported_has_its_deflection_on_every_mesh() {
    let (cells, spacing) = (32, 0.01);
    for diagonals in [Diagonals::OneWay, Diagonals::OtherWay, Diagonals::Alternating, Diagonals::Random] {
        let mesh = grid([cells; 2], spacing, diagonals);
        let found = deflection(&mesh, cells, ElementKind::Plate, BENDING.stiffness);
        let is_even = matches!(diagonals, Diagonals::OneWay | Diagonals::OtherWay);
        let tolerance = if is_even { 0.001 } else { 0.02 };
        assert!((found - 1.0).abs() < tolerance, "{diagonals:?}: {found}");
        // Hinges with the same stiffness along the rows.
        let of_hinges = deflection(&mesh, cells, ElementKind::QuadraticBending, BENDING.stiffness / 3.0);
        assert!(of_hinges < 0.8, "{diagonals:?}: {of_hinges} with hinges");
    }

    let irregular = irregular([cells; 2], spacing, 0);
    let found = deflection(&irregular, cells, ElementKind::Plate, BENDING.stiffness);
    assert!((found - 1.0).abs() < 0.02, "irregular: {found}");
}

#[test]
fn a_strip_hangs_under_its_own_weight_as_an_elastica_and_converges_in_second_order() {
    let rows = table("elastica/cantilever.csv");
    let error = |cells: usize, diagonals: Diagonals, gammas: [f64; 2]| {
        Strip::heavy(cells, diagonals).error(&rows, gammas)
    };
    // Begun as a stiffer one hangs.
    let light = error(60, Diagonals::OneWay, [1.0, 0.1]);
    let heavy = error(60, Diagonals::OneWay, [100.0, 50.0]);
    let [coarse, fine] = [30, 60].map(|cells| error(cells, Diagonals::OtherWay, [10.0, 5.0]));
    for (gamma, found) in [(1, light), (10, fine), (100, heavy)] {
        assert!(found < 1e-3, "Gamma {gamma}: {found} L");
    }
    let order = (coarse / fine).log2();
    assert!((order - 2.0).abs() < 0.3, "{coarse}, {fine}: order {order}");
}

#[test]
fn a_strip_under_end_shear_comes_to_the_displacements_of_sze_liu_and_lo() {
    const LOAD: f64 = 1e-3;
    let rows = table("elastica/cantilever.csv");
    let diagonals = [Diagonals::OneWay, Diagonals::OtherWay].into_iter().cycle();
    for ([load, back, down], diagonals) in END_SHEAR.into_iter().zip(diagonals) {
        let strip = Strip {
            cells: 40,
            diagonals,
            weight: |column, cells| if column == cells { 0.5 * LOAD } else { 1e-6 * LOAD },
        };
        let stiffness = LOAD * strip.length().powi(2) / (load * CELL);
        // A step is about 1 / omega of the lowest mode.
        let [away, below] = strip.tip(stiffness, hung(&rows, 1.0), 0.1 * load.sqrt());
        for (found, expected) in [(10.0 * (1.0 - away), back), (10.0 * below, down)] {
            assert!((found - expected).abs() < 0.01 * expected, "{load}: {found}, expected {expected}");
        }
    }
}

#[test]
fn bending_changes_neither_momentum_nor_what_is_flat() {
    let law = SpringLaw { stiffness: 0.02, damping: 1e-4 };
    let mesh = grid([16, 22], 0.05, Diagonals::Alternating);
    for integrator in Integrator::ALL {
        let mut network = sheet(&mesh, ElementKind::Plate, law);
        for (i, v) in network.v.iter_mut().enumerate() {
            *v = [0.3, -0.2, 0.1 * (i as f64 * 0.7).sin()];
        }
        let mut scene = Scene::new(network, 1e-4).by(by(integrator));
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 500 };
        scene.settings.block_size = 32;
        let mut simulation = scene.simulate(Precision::F64);
        let before = simulation.diagnose();
        let after = advance(&mut simulation, 50).diagnostics;
        for c in 0..3 {
            assert!((before.momentum[c] - after.momentum[c]).abs() < 1e-12, "{integrator:?}: {after:?}");
        }
        assert!(after.elastic_energy > 0.0 && after.elastic_energy < before.kinetic_energy, "{after:?}");

        let network = sheet(&mesh, ElementKind::Plate, law);
        let rest = network.x.clone();
        let mut still = Scene::new(network, 1e-4).by(by(integrator)).simulate(Precision::F64);
        advance(&mut still, 50);
        let found = positions(&still);
        let moved = found.iter().zip(&rest).map(|(x, rest)| length(minus(*x, *rest)));
        let moved = moved.fold(0.0, f64::max);
        assert!(moved < 1e-13, "{integrator:?}: {moved} m");
    }
}

#[test]
fn an_implicit_step_is_the_same_with_the_matrix_stored() {
    let mesh = grid([18, 20], 0.05, Diagonals::Random);
    let run = |operator: OperatorKind, block_size: usize| {
        let mut network = sheet(&mesh, ElementKind::Plate, SpringLaw { stiffness: 0.02, damping: 1e-3 });
        network.masses.fill(1e-3);
        let law = SpringLaw { stiffness: 50.0, damping: 0.01 };
        let rules = SpringRules { stretch: law, shear: Some(law), bend: None };
        network.springs = Network::from_mesh(&mesh, &rules, 1e-3).springs;
        network.pins = vec![0, 18];
        let mut scene = Scene::new(network, 5e-3).by(by(Integrator::ImplicitEuler));
        scene.settings.solver.operator = operator;
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 2000 };
        scene.settings.block_size = block_size;
        let mut simulation = scene.under([0.0, -GRAVITY, 0.0]).simulate(Precision::F64);
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
    let mesh = grid([12, 12], 0.05, Diagonals::Alternating);
    let gain = |share: f64| {
        let mut network = sheet(&mesh, ElementKind::Plate, BENDING);
        for (i, (x, v)) in network.x.iter_mut().zip(&mut network.v).enumerate() {
            x[1] = 1e-3 * noise(i);
            *v = [0.0, 1e-2 * (i as f64 * 1.3).sin(), 0.0];
        }
        let mut scene = Scene::new(network, 1.0).by(by(Integrator::SymplecticEuler));
        let bound = scene.simulate(Precision::F64).step_bounds()[0].dt;
        scene.dt = share * bound;
        let mut simulation = scene.simulate(Precision::F64);
        let before = simulation.diagnose();
        let mut most = 0.0;
        for _ in 0..2000 {
            let Ok(report) = try_advance(&mut simulation, 1) else { return f64::INFINITY };
            let now = report.diagnostics;
            let energy = now.kinetic_energy + now.elastic_energy;
            most = f64::max(most, energy / (before.kinetic_energy + before.elastic_energy));
        }
        most
    };
    assert!(gain(0.9) < 20.0, "{}", gain(0.9));
    assert!(gain(2.0) > 1e6, "the bound is not far from the limit: {}", gain(2.0));
}

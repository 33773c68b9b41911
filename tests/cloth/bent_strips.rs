//! Strips that bend by most of their length: under a load along the tip, as membrane and plate together on regular and irregular triangles,
//! against the table of Sze, Liu and Lo; under their own weight, against curves of the elastica.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use nappe_sim::{
    cloth::{ElementKind, ElementList, Hessian, Integrator, Network, SpringLaw, SpringRules, Threads, Warp},
    linalg::Stop,
    math::Precision,
    mesh::TriangleMesh,
};
use nappe_tests::{
    Method, Scene,
    flat::{Diagonals, grid, irregular},
    golden::table,
    scene::{advance, positions},
    statics::{END_SHEAR, equilibrium},
};

use crate::strips::{CELL as NARROW, Strip, hung, off};

/// Cells along the strip and across it; the first two columns of its points are held, so that the clamp lies amid them.
const CELLS: [usize; 2] = [40, 4];
/// Length from the clamp (m), and side of a cell (m).
const LENGTH: f64 = 10.0;
const CELL: f64 = LENGTH / (CELLS[0] as f64 - 0.5);
/// Stiffness along the threads (N/m), and of bending (N m).
const STRETCH: f64 = 1.2e5;
const BENDING: f64 = 100.0;
const GRAVITY: f64 = 9.81;
/// The strip begins where less load would hold it, by this factor.
const BEGUN: f64 = 0.7;

/// Where a strip under a load per width (N/m) begins, so far (m) from its clamp: away from there and below it (m). Its curvature is
/// load / bending times the distance along x to the tip, whose place comes from the table.
fn begun(load: f64, reach: f64, along: f64) -> [f64; 2] {
    const STEPS: u32 = 400;
    let step = along / f64::from(STEPS);
    let ([mut away, mut below], mut slope) = ([0.0; 2], 0.0_f64);
    for _ in 0..STEPS {
        slope += step * BEGUN * load / BENDING * (reach - away);
        away += step * slope.cos();
        below += step * slope.sin();
    }
    [away, below]
}

/// The strip on a mesh under a load per width (N/m) at its tip, which comes to be so far away from the clamp (m) by the table.
fn strip(mesh: &TriangleMesh, load: f64, reach: f64) -> Network {
    let none = SpringRules { stretch: SpringLaw { stiffness: 0.0, damping: 0.0 }, shear: None, bend: None };
    let mut network = Network::from_mesh(mesh, &none, 0.0);
    network.springs.clear();
    // Without Poisson's ratio shear is half as stiff.
    let threads = Threads { warp: Warp::Along([1.0, 0.0, 0.0]), shares: [1.0, 1.0, 0.5] };
    let law = |stiffness: f64| SpringLaw { stiffness, damping: 0.0 };
    network.elements = vec![
        ElementList::membrane(law(STRETCH), threads, mesh).expect("a warp within the plane"),
        ElementList::new(ElementKind::Plate, law(BENDING), mesh),
    ];
    for (point, [x, _, z]) in mesh.points.iter().copied().enumerate() {
        network.masses[point] = 1e-6 * load * CELL / GRAVITY;
        if point % (CELLS[0] + 1) < 2 {
            network.pins.push(point as u32);
        } else {
            let [away, below] = begun(load, reach, x - 0.5 * CELL);
            network.x[point] = [0.5 * CELL + away, -below, z];
        }
    }
    for (point, width) in tip(mesh) {
        network.masses[point] = load * width / GRAVITY;
    }
    network
}

/// Points of the tip, each with the width (m) whose load it bears.
fn tip(mesh: &TriangleMesh) -> Vec<(usize, f64)> {
    let at = |row: usize| row * (CELLS[0] + 1) + CELLS[0];
    let width = |row: usize| {
        let beside = [row.saturating_sub(1), (row + 1).min(CELLS[1])];
        let [from, to] = beside.map(|row| mesh.points[at(row)][2]);
        0.5 * (to - from)
    };
    (0..=CELLS[1]).map(|row| (at(row), width(row))).collect()
}

/// Every load of the table on a mesh; what is found differs from it by such a share at most.
fn comes_to_the_table(name: &str, mesh: &TriangleMesh, tolerance: f64) {
    let mut worst = 0.0_f64;
    for [load, back, down] in END_SHEAR {
        let network = strip(mesh, load, LENGTH - back);
        let mut scene = Scene::new(network, 0.1).under([0.0, -GRAVITY, 0.0]);
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-12, max_iterations: 8000 };
        // A step is about 1 / omega of the lowest mode.
        let x = equilibrium(&scene, 0.5 * load.sqrt(), 60);

        let (mut places, mut whole) = ([0.0; 2], 0.0);
        for (point, width) in tip(mesh) {
            places = [places[0] + width * x[point][0], places[1] + width * x[point][1]];
            whole += width;
        }
        let found = [LENGTH + 0.5 * CELL - places[0] / whole, -places[1] / whole];
        let off = [found[0] / back - 1.0, found[1] / down - 1.0];
        println!("{name}, load {load}: back {:.4} m, down {:.4} m, off by {off:.4?}", found[0], found[1]);
        worst = off.into_iter().fold(worst, |worst, off| worst.max(off.abs()));
    }
    assert!(worst < tolerance, "{name}: off by {worst} of the displacement");
}

#[test]
fn a_strip_whose_diagonals_run_one_way_comes_to_the_displacements_of_the_table() {
    comes_to_the_table("one way", &grid(CELLS, CELL, Diagonals::OneWay), 0.01);
}

#[test]
fn a_strip_whose_diagonals_run_the_other_way_comes_to_the_displacements_of_the_table() {
    comes_to_the_table("the other way", &grid(CELLS, CELL, Diagonals::OtherWay), 0.01);
}

#[test]
fn a_strip_of_irregular_triangles_comes_to_the_displacements_of_the_table() {
    comes_to_the_table("irregular", &irregular(CELLS, CELL, 2), 0.03);
}

#[test]
fn strips_under_their_own_weight_hang_as_the_table_says_up_to_a_gamma_of_100() {
    let rows = table("elastica/cantilever.csv");
    let gammas: Vec<f64> =
        rows.iter().map(|row| row.number("Gamma")).filter(|gamma| *gamma <= 100.0).collect();
    assert!(gammas.len() > 10 && gammas.is_sorted(), "{gammas:?}");
    for diagonals in [Diagonals::OneWay, Diagonals::OtherWay] {
        // Each begins as the stiffer one before it hangs.
        for pair in gammas.windows(2) {
            let (start, gamma) = (pair[0], pair[1]);
            let drop = hung(&rows, gamma).number("H_over_L");
            let found = Strip::heavy(60, diagonals).error(&rows, [gamma, start]) / drop;
            println!("{diagonals:?}, Gamma {gamma}: {found:.1e} of the drop");
            assert!(found < 0.01, "{diagonals:?}, Gamma {gamma}: {found} of the drop");
        }
    }
}

#[test]
fn a_strip_of_bend_springs_that_cost_as_much_at_one_gamma_leaves_the_table_at_others() {
    let rows = table("elastica/cantilever.csv");
    let strip = Strip::heavy(60, Diagonals::OneWay);
    // A spring over two cells of h that bend by a curvature is shorter by h³ curvature² / 4: two rows of them cost what a plate of
    // the width h does if k = 8 D / (curvature² h⁴). Here at the clamp where Gamma is 10.
    let curvature = hung(&rows, 10.0).number("kappa_clamp_times_L") / strip.length();
    let per_stiffness = 8.0 / (curvature.powi(2) * NARROW.powi(4));
    for gamma in [1.0, 2.0] {
        let (stiffness, row) = (strip.stiffness(gamma), hung(&rows, gamma));
        let mut scene = strip.scene(stiffness, row);
        let law = |stiffness: f64| SpringLaw { stiffness, damping: 0.0 };
        let rules =
            SpringRules { stretch: law(1e5), shear: None, bend: Some(law(per_stiffness * stiffness)) };
        let mesh = grid([strip.cells, 1], NARROW, strip.diagonals);
        scene.network.springs = Network::from_mesh(&mesh, &rules, 0.0).springs;
        scene.network.elements.clear();

        scene.dt = 0.07 * gamma.sqrt();
        let mut simulation =
            scene.by(Method::new(Integrator::ImplicitEuler, Hessian::Absolute)).simulate(Precision::F64);
        advance(&mut simulation, 100);
        let found = off(strip.tip_of(&positions(&simulation)), row);
        println!("bend springs, Gamma {gamma}: {found:.1e} L");
        assert!(found > 0.01, "Gamma {gamma}: {found} L");
    }
}

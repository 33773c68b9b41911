//! Mass, momenta and uniform motion are kept, over every kernel and transfer.
#![allow(clippy::print_stdout, reason = "what is reported and not asserted")]

use nappe_sim::{
    math::Precision,
    snow::{GridNode, Transfer},
    world::Simulation,
};
use nappe_tests::{
    networks::scatter,
    scene::{advance, norm},
    snow::{
        SnowScene, Variant, angular_momentum, elastic, lattice, momentum, object, rework, second_moment,
        step_once,
    },
};

const H: f64 = 0.1;

/// A block that is stretched, twisted and moving at random, with a particle alone beside it.
fn stirred(variant: Variant, precision: Precision) -> (SnowScene, Simulation) {
    let mut x = lattice([-0.23, 0.11, -0.52], [8, 6, 7], [0.5 * H; 3]);
    x.push([1.234, -0.777, 0.301]);
    let block = object("block", x, (0.5 * H).powi(3), 400.0, elastic(1.4e5, 0.2));
    let scene = SnowScene::new(vec![block], H, 1e-4).by(variant);
    let mut simulation = scene.simulate(precision);
    rework(&mut simulation, |i, p| {
        let noise = |k: usize| scatter(31 * i + k);
        p.v = [0, 1, 2].map(|a| 0.3 + noise(a));
        for row in 0..3 {
            for column in 0..3 {
                p.elastic[row][column] += 0.02 * noise(3 + 3 * row + column);
                p.affine[row][column] = 5.0 * noise(12 + 3 * row + column);
            }
        }
    });
    (scene, simulation)
}

#[test]
fn mass_and_momentum_go_to_the_grid_and_come_back() {
    for variant in Variant::all() {
        for (precision, tolerance) in [(Precision::F64, 1e-13), (Precision::F32, 1e-6)] {
            let (scene, mut simulation) = stirred(variant, precision);
            let masses = scene.masses();
            let before = simulation.snow_particles();
            let scale: f64 = before.iter().zip(&masses).map(|(p, m)| m * norm(p.v)).sum();
            let start = momentum(&before, &masses);
            let report = step_once(&mut simulation);
            let mut nodes: Vec<GridNode> = Vec::new();
            simulation.grid_nodes(&mut nodes);
            let what = format!("{} in {precision}", variant.name());

            let mass: f64 = masses.iter().sum();
            let on_grid: f64 = nodes.iter().map(|node| node.mass).sum();
            assert!((on_grid / mass - 1.0).abs() < tolerance, "{what}: mass {on_grid} of {mass}");
            let error = report.snow.expect("a report of the snow").grid_mass_error;
            assert!(error.abs() < tolerance, "{what}: {error:e}");

            let on_grid = [0, 1, 2].map(|a| nodes.iter().map(|n| n.mass * n.velocity[a]).sum::<f64>());
            let end = momentum(&simulation.snow_particles(), &masses);
            for a in 0..3 {
                let [to, back] = [on_grid[a] - start[a], end[a] - start[a]].map(|d| d.abs() / scale);
                assert!(to < tolerance, "{what}: particles to grid changes momentum by {to:e}");
                assert!(back < tolerance, "{what}: a step changes momentum by {back:e}");
            }
        }
    }
}

#[test]
fn affine_transfers_keep_angular_momentum_for_a_thousand_steps() {
    for variant in Variant::all() {
        let (scene, mut simulation) = stirred(variant, Precision::F64);
        let (masses, moment) = (scene.masses(), second_moment(variant.kernel, H));
        let is_affine = !matches!(variant.transfer, Transfer::PicFlip(_));
        let moment = if is_affine { moment } else { 0.0 };
        let total = |s: &Simulation| angular_momentum(&s.snow_particles(), &masses, moment);
        let start = total(&simulation);
        let report = advance(&mut simulation, 1000).snow.expect("a report of the snow");
        let end = total(&simulation);
        let scale = norm(start);
        let change = norm([0, 1, 2].map(|a| end[a] - start[a])) / scale;
        println!("{}: angular momentum changes by {change:.1e} in 1000 steps", variant.name());
        if is_affine {
            assert!(change < 1e-12, "{}: {change:e}", variant.name());
            let told = norm([0, 1, 2].map(|a| report.angular_momentum[a] - end[a])) / scale;
            assert!(told < 1e-12, "{}: the report is off by {told:e}", variant.name());
        }
    }
}

#[test]
fn uniform_motion_stays_uniform_at_nine_tenths_of_a_cell_a_step() {
    // No whole number of steps brings a particle from node to node.
    let v = [0.706_931, -0.318_773, 0.443_113].map(|cells| cells * H / 1e-3);
    for variant in Variant::all() {
        let mut x = lattice([0.0; 3], [6, 6, 6], [0.5 * H; 3]);
        x.extend((0..20).map(|i| [0, 1, 2].map(|a| 1.0 + scatter(3 * i + a))));
        let body = object("block", x, (0.5 * H).powi(3), 400.0, elastic(1.4e5, 0.2));
        let scene = SnowScene::new(vec![body], H, 1e-3).by(variant).moving(|_| v);
        let mut simulation = scene.simulate(Precision::F64);
        advance(&mut simulation, 100);

        for (i, p) in simulation.snow_particles().iter().enumerate() {
            for a in 0..3 {
                let off = (p.v[a] / v[a] - 1.0).abs();
                assert!(off < 1e-13, "{}: particle {i} is off by {off:e}", variant.name());
                for b in 0..3 {
                    let strain = (p.elastic[a][b] - f64::from(u8::from(a == b))).abs();
                    assert!(strain < 1e-12, "{}: particle {i} is strained by {strain:e}", variant.name());
                }
            }
        }
    }
}

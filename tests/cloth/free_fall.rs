//! A sheet that falls freely keeps its place and its shape: what the solver may leave over is measured against what is not
//! common to all of it.

use nappe_sim::{
    cloth::{Hessian, Integrator, Network, SpringLaw, SpringRules},
    linalg::{PreconditionerKind, SolverSettings, Stop},
    math::Precision,
    mesh::TriangleMesh,
};
use nappe_tests::{
    Method, Scene,
    networks::sheet_rules,
    scene::{advance, norm, positions},
};

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];
const SIDE: usize = 20;

/// A rippled sheet of 20 x 20 particles at rest, by nothing held.
fn rippled() -> Network {
    let mut mesh = TriangleMesh::grid(SIDE, SIDE, 0.03);
    for [x, y, _] in &mut mesh.points {
        *y = 0.02 * (-2.5 * *x / 0.03).sin();
    }
    let law = |stiffness, damping| SpringLaw { stiffness, damping };
    let rules =
        SpringRules { stretch: law(1000.0, 1.0), shear: Some(law(333.0, 0.3)), bend: Some(law(10.0, 0.0)) };
    Network::from_lattice(&mesh, [SIDE, SIDE], &rules, 1.6e-4)
}

/// How far the first sheet went aside, and how far a particle of it goes beside the others (m), in so many steps of 10 ms.
fn drift(scene: &Scene, precision: Precision, steps: u64) -> [f64; 2] {
    let mut simulation = scene.simulate(precision);
    let before = positions(&simulation);
    advance(&mut simulation, steps);
    let after = positions(&simulation);
    let count = SIDE * SIDE;
    let moved: Vec<_> = (0..count).map(|i| [0, 1, 2].map(|c| after[i][c] - before[i][c])).collect();
    let mean = [0, 1, 2].map(|c| moved.iter().map(|d| d[c]).sum::<f64>() / count as f64);
    let beside = |d: &[f64; 3]| norm([0, 1, 2].map(|c| d[c] - mean[c]));
    [mean[0].hypot(mean[2]), moved.iter().map(beside).fold(0.0, f64::max)]
}

fn falling(network: Network, integrator: Integrator) -> Scene {
    let method = Method::new(integrator, Hessian::Absolute);
    let mut scene = Scene::new(network, 0.01).by(method).under(GRAVITY);
    let preconditioner = PreconditionerKind::BlockJacobi;
    scene.settings.solver = SolverSettings { preconditioner, ..SolverSettings::default() };
    scene
}

#[test]
fn a_sheet_in_free_fall_goes_nowhere_else_and_keeps_its_shape() {
    for (integrator, steps) in
        [(Integrator::ImplicitEuler, 300), (Integrator::ImplicitMidpoint, 100), (Integrator::Bdf2, 100)]
    {
        let [aside, shape] = drift(&falling(rippled(), integrator), Precision::F64, steps);
        // With a tolerance relative to gravity it came to 1 mm in 3 s, and 0.1 mm in 1 s.
        assert!(aside < 5e-5 && shape < 5e-5, "{integrator:?}: {aside:e} m aside, {shape:e} m of shape");
    }
    // In binary32 a second: what is 5 m down rounds to a quarter of a micrometre each step.
    for warm_start in [false, true] {
        let mut scene = falling(rippled(), Integrator::ImplicitEuler);
        scene.settings.solver.warm_start = warm_start;
        let [aside, shape] = drift(&scene, Precision::F32, 100);
        assert!(aside < 5e-5 && shape < 5e-5, "{warm_start}: {aside:e} m aside, {shape:e} m of shape");
    }
}

#[test]
fn a_free_sheet_beside_a_hung_one_in_wind_moves_with_the_wind_and_as_a_whole() {
    let mut network = rippled();
    let count = network.x.len() as u32;
    let mesh = TriangleMesh::grid(6, 6, 0.05);
    let hung = Network::from_lattice(&mesh, [6, 6], &sheet_rules(100.0, 0.1), 1e-3);
    network.x.extend(hung.x.iter().map(|[x, y, z]| [x + 3.0, *y, *z]));
    network.v.extend(hung.v);
    network.masses.extend(hung.masses);
    for mut spring in hung.springs {
        spring.particles = spring.particles.map(|particle| particle + count);
        network.springs.push(spring);
    }
    network.pins = vec![count, count + 5];
    network.drag = 1e-4;
    let mut scene = falling(network, Integrator::ImplicitEuler);
    scene.wind = [2.0, 0.0, 0.0];
    // Both are one solve, whose residual counts against the weight of the hung one too.
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-8, max_iterations: 400 };
    let [aside, shape] = drift(&scene, Precision::F64, 100);

    // v' = (v + h (drag / m) wind) / (1 + h drag / m), x' = x + h v', of every particle of the free one.
    let rate = 0.01 * 1e-4 / 1.6e-4;
    let (mut x, mut v) = (0.0, 0.0);
    for _ in 0..100 {
        v = (v + rate * 2.0) / (1.0 + rate);
        x += 0.01 * v;
    }
    assert!((aside - x).abs() < 1e-6 && shape < 5e-5, "{aside} m, not {x}; {shape:e} m of shape");
}

#[test]
fn a_solve_of_a_fixed_number_of_iterations_falls_as_the_whole_does() {
    // One iteration: momentum is right nevertheless, whatever the masses are.
    let mut network = rippled();
    network.masses.iter_mut().enumerate().for_each(|(i, m)| *m *= 1.0 + (i % 7) as f64);
    let mass: f64 = network.masses.iter().sum();
    let mut scene = falling(network, Integrator::ImplicitEuler);
    scene.settings.solver.stop = Stop::Iterations(1);
    let momentum = advance(&mut scene.simulate(Precision::F64), 10).diagnostics.momentum;
    let expected = mass * -9.81 * 0.1;
    assert!((momentum[1] / expected - 1.0).abs() < 1e-9, "{momentum:?} kg m/s, not {expected}");
}

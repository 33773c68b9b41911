//! Vertex block descent against Newton's method: two ways to one minimum.

use nappe_sim::{
    cloth::{ElementKind, ElementList, Hessian, Integrator, Minimizer, Network, NewtonSettings, SpringLaw},
    linalg::SolverSettings,
    math::Precision,
    mesh::TriangleMesh,
    report::StepFailure,
    world::Simulation,
};
use nappe_tests::{
    Method, NEWTON, Scene,
    networks::{scatter, sheet, sheet_rules},
    scene::{advance, max_distance, positions},
};

/// A damped sheet of several blocks with bending, pinned and shaken.
fn shaken(integrator: Integrator, minimizer: Minimizer) -> Scene {
    let side = 14;
    let mut network = sheet(side, 0.1, &sheet_rules(200.0, 0.05), 0.01);
    network.drag = 0.002;
    let law = SpringLaw { stiffness: 1e-3, damping: 1e-5 };
    let mesh = TriangleMesh::grid(side, side, 0.1);
    network.elements = vec![ElementList::new(ElementKind::QuadraticBending, law, &mesh)];
    let pins = network.pins.clone();
    for (i, x) in network.x.iter_mut().enumerate().filter(|(i, _)| !pins.contains(&(*i as u32))) {
        *x = [0, 1, 2].map(|c| x[c] + 0.004 * scatter(3 * i + c));
    }
    let method = Method { minimizer, ..Method::new(integrator, Hessian::Absolute) };
    let mut scene = Scene::new(network, 0.01).by(method).under([0.0, -9.81, 0.0]);
    scene.settings.block_size = 64;
    scene
}

#[test]
fn its_sweeps_converge_to_the_step_of_newtons_method() {
    for integrator in [Integrator::ImplicitEuler, Integrator::ImplicitMidpoint, Integrator::Bdf2] {
        let run = |minimizer| {
            let mut simulation = shaken(integrator, minimizer).simulate(Precision::F64);
            advance(&mut simulation, 2);
            positions(&simulation)
        };
        let exact = run(NEWTON);
        let distance = |sweeps| max_distance(&run(Minimizer::VertexBlockDescent { sweeps }), &exact);
        let [few, more, many] = [10, 20, 160].map(distance);
        assert!(few < 1e-4 && more < 0.1 * few, "{}: {few:e}, then {more:e} m", integrator.name());
        assert!(many < 1e-14, "{}: {many:e} m", integrator.name());
    }
}

#[test]
fn blocks_of_a_stiff_cloth_that_touch_take_turns() {
    let run = |minimizer| {
        let mut network = sheet(14, 0.1, &sheet_rules(1e4, 0.0), 0.01);
        // Under tension there is one minimum.
        network.x.iter_mut().flatten().enumerate().for_each(|(i, x)| *x = 1.1 * *x + 0.004 * scatter(i));
        let method = Method { minimizer, ..Method::new(Integrator::ImplicitEuler, Hessian::Absolute) };
        let mut scene = Scene::new(network, 0.01).by(method).under([0.0, -9.81, 0.0]);
        scene.settings.block_size = 32;
        let mut simulation = scene.simulate(Precision::F64);
        advance(&mut simulation, 1);
        positions(&simulation)
    };
    let exact = run(NEWTON);
    let [few, many] =
        [40, 400].map(|sweeps| max_distance(&run(Minimizer::VertexBlockDescent { sweeps }), &exact));
    assert!(few < 1e-3 && many < 1e-11, "{few:e}, then {many:e} m");
}

#[test]
fn few_sweeps_of_a_stiff_cloth_are_soft_and_stay_bounded() {
    let stretches = [5, 20, 80].map(|sweeps| {
        let mut network = sheet(24, 0.05, &sheet_rules(1e4, 0.0), 0.005);
        network.drag = 1e-3;
        let method = Method::by_sweeps(Integrator::ImplicitEuler, sweeps);
        let scene = Scene::new(network, 1.0 / 60.0).by(method).under([0.0, -9.81, 0.0]).certified();
        let mut simulation = scene.simulate(Precision::F64);
        (0..60).map(|_| advance(&mut simulation, 1).diagnostics.max_stretch).fold(0.0, f64::max)
    });
    assert!(stretches.is_sorted_by(|few, many| few > many), "{stretches:?}");
    assert!(stretches[0] < 1.5 && stretches[2] < 1.25, "{stretches:?}");
}

/// A square of cloth of 1 600 particles of 5 g, 0.02 m apart, without pins, lying.
fn square(stiffness: f64) -> Network {
    let mut network = sheet(40, 0.02, &sheet_rules(stiffness, 0.0), 0.005);
    network.pins.clear();
    network
}

#[test]
fn what_nothing_holds_falls_freely_at_every_stiffness() {
    let (dt, steps) = (1.0 / 60.0, 30);
    for stiffness in [1e2, 1e4, 1e6] {
        for sweeps in [5, 20, 80] {
            for is_upright in [false, true] {
                let method = Method::by_sweeps(Integrator::ImplicitEuler, sweeps);
                let mut network = square(stiffness);
                if is_upright {
                    network.x.iter_mut().for_each(|x| x.swap(1, 2));
                }
                let scene = Scene::new(network, dt).by(method).under([0.0, -9.81, 0.0]);
                let mut simulation = scene.certified().simulate(Precision::F64);
                let start = mean_height(&simulation);
                let substeps: u32 =
                    (0..steps).map(|_| advance(&mut simulation, 1).cloth.expect("a cloth").substeps).sum();
                let fallen = start - mean_height(&simulation);
                // The definition's g h² n (n + 1) / 2; of shorter sub-steps between that and g t² / 2.
                let time = dt * f64::from(steps);
                let [exact, defined] = [0.0, dt].map(|dt| 0.5 * 9.81 * time * (time + dt));
                let is_right = if substeps == steps {
                    (fallen / defined - 1.0).abs() < 1e-9
                } else {
                    (exact..defined).contains(&fallen)
                };
                let which = format!("{stiffness:e} N/m, {sweeps} sweeps, upright: {is_upright}");
                assert!(is_right, "{which}: {fallen} of {defined} m in {substeps} sub-steps");
            }
        }
    }
}

fn mean_height(simulation: &Simulation) -> f64 {
    let x = positions(simulation);
    x.iter().map(|x| x[1]).sum::<f64>() / x.len() as f64
}

#[test]
fn a_sheet_that_hangs_stretches_as_newtons_method_has_it() {
    let stretch = |minimizer| {
        let mut network = square(1e4);
        network.pins = vec![0, 39];
        let method = Method { minimizer, ..Method::new(Integrator::ImplicitEuler, Hessian::Absolute) };
        let mut scene = Scene::new(network, 1.0 / 60.0).by(method).under([0.0, -9.81, 0.0]).certified();
        scene.settings.solver = SolverSettings::default();
        let mut simulation = scene.simulate(Precision::F64);
        (0..60).map(|_| advance(&mut simulation, 1).diagnostics.max_stretch).fold(0.0, f64::max)
    };
    let exact = stretch(Minimizer::Newton(NewtonSettings { tolerance: 0.1, max_iterations: 50 }));
    for sweeps in [20, 80] {
        let found = stretch(Minimizer::VertexBlockDescent { sweeps });
        assert!((exact - 0.02..1.1 * exact).contains(&found), "{sweeps} sweeps: {found} for {exact}");
    }
}

#[test]
fn a_step_whose_momentum_does_not_balance_is_taken_again() {
    let mut network = square(1e6);
    network.pins = vec![0, 39];
    let scene = Scene::new(network, 1.0 / 60.0).by(Method::by_sweeps(Integrator::ImplicitEuler, 5));
    let mut simulation = scene.under([0.0, -9.81, 0.0]).certified().simulate(Precision::F64);
    let reports: Vec<_> = (0..4).map(|_| advance(&mut simulation, 1)).collect();
    let causes: Vec<_> = reports.iter().flat_map(|report| &report.rejections).map(|it| &it.cause).collect();
    let unbalanced = |cause: &&StepFailure| matches!(cause, StepFailure::Unbalanced { value, limit, sweeps: 80, particle: 1 } if value > limit);
    assert!(!causes.is_empty() && causes.iter().all(unbalanced), "{causes:?}");
}

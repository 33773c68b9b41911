//! Vertex block descent against Newton's method: two ways to one minimum.

use nappe_sim::{
    cloth::{ElementKind, ElementList, Hessian, Integrator, Minimizer, SpringLaw},
    math::Precision,
    mesh::TriangleMesh,
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

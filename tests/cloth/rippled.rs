//! A stiff sheet with ripples that hangs by two corners, step by step by Newton's method; and a sheet that is squeezed.

use nappe_sim::{
    cloth::{ElementKind, ElementList, Hessian, Integrator, Minimizer, NewtonSettings, SpringLaw},
    linalg::{Outcome, PreconditionerKind, SolverSettings},
    math::Precision,
    mesh::TriangleMesh,
    world::Simulation,
};
use nappe_tests::{
    Method, Scene,
    networks::{sheet, sheet_rules},
    scene::{advance, of_text, positions},
};

/// A rippled sheet of `grid` particles, whose body has further keys.
///
/// # Panics
/// When one of them is bad.
pub(crate) fn rippled([columns, rows]: [u32; 2], keys: &str) -> Simulation {
    let text = format!(
        r#"
        version = 1
        dt = 0.016666666
        [[body]]
        name = "a"
        {keys}
        mesh = {{ grid = [{columns}, {rows}], spacing = 0.008, plane = "upright", ripple = 0.002 }}
        mass = {{ density = 0.15 }}
        pins = ["top_left", "top_right"]
        springs = {{ stretch = {{ stiffness = 12000 }}, shear = {{ stiffness = 12000 }}, bend = {{ stiffness = 300 }} }}
        "#
    );
    of_text(&text, Precision::F64)
}

/// Takes steps of a rippled sheet of `grid` particles, each of which must converge in so many iterates.
///
/// # Panics
/// When one does not.
pub(crate) fn a_rippled_sheet_converges(grid: [u32; 2], steps: u64, iterates: u32) {
    let mut simulation = rippled(grid, &format!("minimizer = \"newton\"\nnewton_iterations = {iterates}"));
    for step in 1..=steps {
        let report = advance(&mut simulation, 1);
        let solve = report.solve.expect("an implicit step");
        assert_eq!(solve.outcome, Outcome::Converged, "step {step}: {solve:?}");
    }
}

/// Squeezes a flat sheet of `side` x `side` particles by a hundredth between two held edges, so stiff against bending (N m)
/// that it can buckle in long waves alone; one step must buckle it.
///
/// # Panics
/// When it stays flat.
pub(crate) fn a_squeezed_sheet_buckles(side: usize, bending: f64) {
    let spacing = 0.01;
    let mut network = sheet(side, spacing, &sheet_rules(1000.0, 0.0), 1e-3);
    let mesh = TriangleMesh::grid(side, side, spacing);
    let law = SpringLaw { stiffness: bending, damping: 0.0 };
    network.elements = vec![ElementList::new(ElementKind::QuadraticBending, law, &mesh)];
    let held = |i: usize| [0, side - 1].contains(&(i % side));
    network.pins = (0..side * side).filter(|&i| held(i)).map(|i| i as u32).collect();
    for x in &mut network.x {
        x[0] *= 0.99;
    }

    let minimizer = Minimizer::Newton(NewtonSettings::default());
    let method = Method { minimizer, ..Method::new(Integrator::ImplicitEuler, Hessian::Absolute) };
    let mut scene = Scene::new(network, 1.0).by(method);
    scene.settings.solver = SolverSettings {
        stop: minimizer.default_stop(),
        preconditioner: PreconditionerKind::TwoLevel,
        ..SolverSettings::default()
    };
    let mut simulation = scene.simulate(Precision::F64);
    advance(&mut simulation, 1);
    let height = positions(&simulation).iter().fold(0.0, |height, x| f64::max(height, x[1].abs()));
    assert!(height > 0.005, "{side} x {side}: {height} m out of its plane");
}

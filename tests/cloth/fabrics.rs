//! Fabrics: membrane and plate together, whatever solves for them; and which law bounds their explicit steps.

use nappe_sim::{
    cloth::{ElementKind, ElementList, Hessian, Integrator, Network, SpringLaw, SpringRules, Threads, Warp},
    linalg::{OperatorKind, Outcome, PreconditionerKind, Stop},
    math::Precision,
    mesh::TriangleMesh,
    report::{BoundKind, StepFailure},
};
use nappe_tests::{
    Method, Scene,
    networks::scatter,
    scene::{advance, max_distance, of_text, positions, try_advance},
};

/// A square metre of a stiff fabric of 0.2 kg whose points are off their places, crumpled a little, that hangs by two corners.
fn hung(side: usize) -> Network {
    let spacing = 1.0 / (side - 1) as f64;
    let mut mesh = TriangleMesh::grid(side, side, spacing);
    for (i, [x, _, z]) in mesh.points.iter_mut().enumerate() {
        *x += 0.2 * spacing * scatter(2 * i);
        *z += 0.2 * spacing * scatter(2 * i + 1);
    }
    let none = SpringRules { stretch: SpringLaw { stiffness: 0.0, damping: 0.0 }, shear: None, bend: None };
    let mut network = Network::from_mesh(&mesh, &none, 0.2 / (side * side) as f64);
    network.springs.clear();
    let stretch = SpringLaw { stiffness: 9e3, damping: 0.1 };
    let threads = Threads { warp: Warp::Along([0.6, 0.0, 0.8]), shares: [1.0, 0.7, 0.02] };
    let bending = SpringLaw { stiffness: 6e-5, damping: 6e-7 };
    network.elements = vec![
        ElementList::membrane(stretch, threads, &mesh).expect("a warp within the plane"),
        ElementList::new(ElementKind::Plate, bending, &mesh),
    ];
    network.pins = vec![0, side as u32 - 1];
    network.x.iter_mut().enumerate().for_each(|(i, [_, y, _])| *y += 0.002 * scatter(i));
    network
}

#[test]
fn every_preconditioner_and_operator_solves_for_the_same_step_of_a_fabric() {
    let network = hung(40);
    for hessian in [Hessian::Absolute, Hessian::Clamped] {
        let run = |kind: PreconditionerKind, operator: OperatorKind| {
            let method = Method::new(Integrator::ImplicitEuler, hessian);
            let mut scene = Scene::new(network.clone(), 1.0 / 60.0).by(method).under([0.0, -9.81, 0.0]);
            scene.settings.solver.preconditioner = kind;
            scene.settings.solver.operator = operator;
            scene.settings.solver.stop = Stop::Residual { tolerance: 1e-12, max_iterations: 10_000 };
            let mut simulation = scene.simulate(Precision::F64);
            let solve = advance(&mut simulation, 1).solve.expect("an implicit step solves");
            // A preconditioner that is not positive would end the solve.
            assert_eq!(solve.outcome, Outcome::Converged, "{hessian:?}, {kind:?}, {operator:?}: {solve:?}");
            positions(&simulation)
        };
        let expected = run(PreconditionerKind::BlockJacobi, OperatorKind::MatrixFree);
        let kinds =
            [PreconditionerKind::BlockJacobi, PreconditionerKind::TwoLevel, PreconditionerKind::Patches];
        for (kind, operator) in
            kinds.into_iter().flat_map(|kind| OperatorKind::ALL.map(|operator| (kind, operator)))
        {
            let off = max_distance(&run(kind, operator), &expected);
            assert!(off < 1e-9, "{hessian:?}, {kind:?}, {operator:?}: {off:e} m");
        }
    }
}

#[test]
fn a_step_that_needs_too_many_sub_steps_names_the_law_that_bounds_it() {
    // Cells of a millimetre, and a bending stiffness as it is and a thousand times that.
    for (bending, law) in [("6e-5", "membrane"), ("0.1", "plate")] {
        let text = format!(
            "version = 1\ndt = 0.1\n[[body]]\nname = \"b\"\nmesh = {{ grid = [9, 9], spacing = 0.001 }}\n\
             material = {{ preset = \"denim\", bending = {bending} }}\nintegrator = \"symplectic_euler\"\n"
        );
        let error = try_advance(&mut of_text(&text, Precision::F64), 1).expect_err("it is far too stiff");
        let StepFailure::Substeps { bound, law: found, limit, .. } = &error.failure else {
            panic!("{error}")
        };
        assert_eq!((*bound, found.as_deref(), *limit), (BoundKind::Stiffness, Some(law), 10_000), "{error}");
        assert!(error.to_string().contains(&format!(", most of it by {law}, allows")), "{error}");
    }

    let springs = "version = 1\ndt = 0.1\n[[body]]\nname = \"b\"\nmesh = { grid = [9, 9], spacing = 0.001 }\n\
        mass = { density = 0.1 }\nintegrator = \"symplectic_euler\"\n\
        springs = { stretch = { stiffness = 9000 }, shear = { stiffness = 100 } }\n";
    let error = try_advance(&mut of_text(springs, Precision::F64), 1).expect_err("it is far too stiff");
    let StepFailure::Substeps { law: Some(found), .. } = &error.failure else { panic!("{error}") };
    assert_eq!(found, "springs.stretch", "{error}");
}

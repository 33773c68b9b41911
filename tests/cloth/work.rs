//! What steps cost, counted: evaluations of forces and products with the matrix, against counts made by hand.

use nappe_sim::{
    cloth::{Hessian, Integrator, Minimizer, NewtonSettings},
    math::Precision,
    report::{StepReport, Work},
    world::{BodySetup, Simulation},
};
use nappe_tests::{
    Method, Scene,
    networks::{chain, sheet, sheet_rules},
    scene::advance,
};

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];

/// A hung sheet of several blocks, without damping.
fn hung(method: Method) -> Scene {
    let mut scene =
        Scene::new(sheet(10, 0.1, &sheet_rules(200.0, 0.0), 0.01), 1e-3).by(method).under(GRAVITY);
    scene.settings.block_size = 32;
    scene
}

/// The third step, which starts from a state that the one before has evaluated, for the same lengths of steps.
fn third(scene: &Scene) -> StepReport {
    let mut simulation = scene.simulate(Precision::F64);
    advance(&mut simulation, 3)
}

#[test]
fn explicit_steps_evaluate_what_their_definitions_say() {
    for (integrator, expected) in [
        (Integrator::ExplicitEuler, 1),
        (Integrator::SymplecticEuler, 1),
        (Integrator::VelocityVerlet, 2),
        (Integrator::VelocityVerletPredicted, 2),
    ] {
        let scene = hung(Method::new(integrator, Hessian::Absolute));
        let counted = Work { force_evaluations: expected, matrix_products: 0 };
        assert_eq!(third(&scene).work, counted, "{integrator:?}");

        let divided = third(&scene.in_substeps(4)).work;
        assert_eq!(divided.force_evaluations, 4 * expected, "{integrator:?} in four sub-steps");
    }
}

#[test]
fn one_solve_per_step_evaluates_its_end_and_multiplies_as_its_solve_says() {
    // The midpoint evaluates the middle too. BDF2 starts from where the steps before lead, and not from the state.
    for (integrator, expected) in
        [(Integrator::ImplicitEuler, 1), (Integrator::ImplicitMidpoint, 2), (Integrator::Bdf2, 2)]
    {
        let report = third(&hung(Method::new(integrator, Hessian::Absolute)));
        let solve = report.solve.expect("a solve");
        assert!(solve.products > solve.iterations, "{solve:?}");
        let products = u64::from(solve.products);
        let counted = Work { force_evaluations: expected, matrix_products: products };
        assert_eq!(report.work, counted, "{integrator:?}");
    }
}

#[test]
fn a_warm_start_costs_the_product_that_its_residual_takes() {
    let cold = hung(Method::new(Integrator::ImplicitEuler, Hessian::Absolute));
    let mut warm = cold.clone();
    warm.settings.solver.warm_start = true;
    let [cold, warm] = [cold, warm].map(|scene| third(&scene));
    let of = |report: &StepReport| {
        let solve = report.solve.expect("a solve");
        assert_eq!(report.work.matrix_products, u64::from(solve.products));
        solve.products - solve.iterations
    };
    assert_eq!(of(&warm), of(&cold) + 1);
}

#[test]
fn iterates_of_newtons_method_are_evaluated_one_by_one() {
    // Particles on their own: the first iterate is the solution.
    let mut scene = hung(Method::new(Integrator::ImplicitEuler, Hessian::Absolute));
    scene.settings.minimizer = Minimizer::Newton(NewtonSettings::default());
    scene.network.springs.clear();
    let free = third(&scene).work;
    // One evaluation where it starts, one after the solve. What looks for a saddle freezes the exact tangent there.
    assert_eq!(free.force_evaluations, 2);

    // A chain that hangs straight has no saddle near: each further iterate costs one evaluation.
    let x: Vec<_> = (0..10).map(|i| [0.0, -0.1 * f64::from(i), 0.0]).collect();
    let mut network = chain(&x, 0.1, 100.0, 0.0, 0.01);
    network.pins = vec![0];
    let mut scene = Scene { network, ..scene };
    let work = |iterations: u32, scene: &mut Scene| {
        let newton = NewtonSettings { tolerance: 0.0, max_iterations: iterations };
        scene.settings.minimizer = Minimizer::Newton(newton);
        third(scene).work
    };
    let [one, two] = [1, 2].map(|iterations| work(iterations, &mut scene));
    assert_eq!(one.force_evaluations, 2);
    assert_eq!(two.force_evaluations, 3);
    assert!(two.matrix_products > one.matrix_products);
}

#[test]
fn a_sweep_of_vertex_block_descent_is_an_evaluation() {
    let of = |sweeps| third(&hung(Method::by_sweeps(Integrator::ImplicitEuler, sweeps))).work;
    // Beside the sweeps: where they start, and where they end.
    assert_eq!(of(5), Work { force_evaluations: 5 + 2, matrix_products: 0 });
    assert_eq!(of(9), Work { force_evaluations: 9 + 2, matrix_products: 0 });

    // What nothing pins moves as a whole in the end, and is evaluated there.
    let mut scene = hung(Method::by_sweeps(Integrator::ImplicitEuler, 5));
    scene.network.pins.clear();
    scene.network.x.iter_mut().for_each(|x| x[0] *= 1.1);
    assert_eq!(third(&scene).work.force_evaluations, 5 + 3);
}

#[test]
fn what_is_rejected_counts() {
    // As in steps.rs: a stiff sheet that spins, whose first step is tried whole, in halves and in quarters.
    let mut network = sheet(12, 0.05, &sheet_rules(1e6, 0.0), 0.01);
    network.pins.clear();
    for (x, v) in network.x.iter().zip(&mut network.v) {
        *v = [-30.0 * (x[2] - 0.275), 0.0, 30.0 * (x[0] - 0.275)];
    }
    let method = Method::new(Integrator::ImplicitEuler, Hessian::Absolute);
    let scene = Scene::new(network, 1.0 / 60.0).by(method).certified();
    let report = advance(&mut scene.simulate(Precision::F64), 1);
    let steps = report.cloth.expect("a cloth");
    assert_eq!((steps.substeps, steps.rejected), (6, 3));
    // Each try evaluates where it leads; and where it starts, if its length is not that of the one before or that one
    // was rejected: 3 times that were rejected, the first eighth, the first quarter.
    assert_eq!(report.work.force_evaluations, (3 + 6) + (3 + 1 + 1));

    let accepted: u64 = u64::from(report.solve.expect("a solve").products);
    assert!(report.work.matrix_products > accepted, "{report:?}");
}

#[test]
fn bodies_are_added_up() {
    for method in Method::all() {
        let scene = hung(method);
        let alone = third(&scene).work;
        let mut setup = scene.setup();
        let twin = BodySetup { name: "twin".to_owned(), ..setup.bodies[0].clone() };
        setup.bodies.push(twin);
        let (mut both, _) = Simulation::new(&setup, Precision::F64).expect("two sheets");
        assert_eq!(advance(&mut both, 3).work, alone.and(alone), "{}", method.name());
    }
}

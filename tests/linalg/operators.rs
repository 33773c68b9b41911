//! Solver settings that must not change the answer: operator, preconditioner, warm start.

use nappe_sim::{
    linalg::{OperatorKind, Outcome, PreconditionerKind, Stop},
    math::Precision,
};
use nappe_tests::{
    Method, Scene, golden,
    networks::{scatter, sheet, sheet_rules},
    scene::{advance, max_distance, positions},
};

/// A sheet of several blocks, pinned and shaken: stretched and compressed springs.
fn shaken(method: Method) -> Scene {
    let mut network = sheet(20, 0.1, &sheet_rules(200.0, 0.05), 0.01);
    network.drag = 0.002;
    for (i, x) in network.x.iter_mut().enumerate().filter(|(i, _)| *i != 0 && *i != 19) {
        *x = [0, 1, 2].map(|c| x[c] + 0.004 * scatter(3 * i + c));
    }
    let mut scene = Scene::new(network, 2e-3).by(method).under([0.0, -9.81, 0.0]);
    scene.settings.block_size = 64;
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-12, max_iterations: 400 };
    scene
}

fn solving_methods() -> Vec<Method> {
    let solves = |method: &Method| method.integrator.is_implicit() && !method.is_by_sweeps();
    Method::all().into_iter().filter(solves).collect()
}

#[test]
fn the_assembled_matrix_is_the_one_that_is_never_stored() {
    for method in solving_methods() {
        for precision in Precision::ALL {
            let run = |operator| {
                let mut scene = shaken(method);
                scene.settings.solver.operator = operator;

                // A fixed number of iterations compares the products themselves.
                scene.settings.solver.stop = Stop::Iterations(5);
                let mut simulation = scene.simulate(precision);
                let report = advance(&mut simulation, 3);
                (positions(&simulation), report.solve.expect("an implicit step solves"))
            };
            let [(free, a), (assembled, b)] = OperatorKind::ALL.map(run);
            let tolerance = if precision == Precision::F64 { 1e-14 } else { 4e-6 };
            let distance = max_distance(&free, &assembled);
            assert!(distance < tolerance, "{} in {precision}: {distance:e} m", method.name());
            let residuals = [a, b].map(|report| report.relative_residual);
            // Below it is a matter of rounding.
            if residuals[1] < tolerance {
                continue;
            }
            assert!((residuals[0] / residuals[1] - 1.0).abs() < 1e4 * tolerance, "{residuals:?}");
        }
    }
}

#[test]
fn preconditioners_and_warm_starts_lead_to_the_same_states() {
    for method in solving_methods() {
        let run = |preconditioner, warm_start| {
            let mut scene = shaken(method);
            scene.settings.solver.preconditioner = preconditioner;
            scene.settings.solver.warm_start = warm_start;
            let mut simulation = scene.simulate(Precision::F64);
            for _ in 0..10 {
                let report = advance(&mut simulation, 1).solve.expect("an implicit step solves");
                assert_eq!(report.outcome, Outcome::Converged, "{}", method.name());
            }

            positions(&simulation)
        };

        let reference = run(PreconditionerKind::BlockJacobi, false);
        for preconditioner in PreconditionerKind::ALL {
            for warm_start in [false, true] {
                let distance = max_distance(&run(preconditioner, warm_start), &reference);
                let label = format!("{}, {}, warm {warm_start}", method.name(), preconditioner.name());
                assert!(distance < 1e-12, "{label}: {distance:e} m");
            }
        }
    }
}

#[test]
fn block_jacobi_needs_no_more_iterations_than_the_diagonal_nor_that_than_nothing() {
    let count = |preconditioner| {
        let mut scene = shaken(golden::method("implicit_euler_clamped").expect("an integrator"));

        // Masses that differ by four orders give a preconditioner something to do.
        scene.network.masses.iter_mut().enumerate().for_each(|(i, m)| *m *= 100_f64.powf(scatter(i)));
        scene.settings.solver.preconditioner = preconditioner;
        let mut simulation = scene.simulate(Precision::F64);
        advance(&mut simulation, 1).solve.expect("an implicit step solves").iterations
    };

    let [none, diagonal, blocks, two_level, patches, auto] = PreconditionerKind::ALL.map(count);
    assert!(blocks <= diagonal && diagonal < none, "{none}, {diagonal}, {blocks} iterations");
    // Here a coarse space has nothing to carry: light particles are held by their mass alone.
    assert!(two_level <= 2 * blocks, "{two_level} and {blocks} iterations");
    // Soft functions hold whatever is soft.
    assert!(patches <= blocks, "{patches} and {blocks} iterations");
    assert_eq!(auto, blocks);
}

#[test]
fn a_warm_start_saves_iterations_in_a_smooth_motion() {
    let count = |warm_start| {
        let mut scene = shaken(golden::method("implicit_euler_clamped").expect("an integrator"));
        scene.settings.solver.warm_start = warm_start;
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-4, max_iterations: 400 };
        let mut simulation = scene.simulate(Precision::F64);
        (0..40).map(|_| advance(&mut simulation, 1).solve.expect("solves").iterations).sum::<u32>()
    };

    let [cold, warm] = [false, true].map(count);
    assert!(warm < cold, "{warm} iterations from the last solution, {cold} from 0");
}

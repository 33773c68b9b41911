//! How a solve ends that does not simply converge: at its cap, at the limit of its precision, at a preconditioner that
//! is none.

use nappe_sim::{
    linalg::{
        BlockCsr, CgWorkspace, Identity, LinearOperator, Outcome, Preconditioner, PreconditionerKind,
        SolverSettings, Stop, conjugate_gradient,
    },
    math::{Padded, Precision, Sixteen, Vec3},
    parallel::Share,
};
use nappe_tests::{
    Scene, golden,
    networks::{sheet, sheet_rules},
    scene::{advance, positions, velocities},
    systems::System,
};

/// A flat sheet at rest that is stiff for its step: dt² k / m is 2 778. Gravity pulls it along its plane, away from the
/// two corners that hold it.
fn stiff_sheet(side: usize) -> Scene {
    let method = golden::method("implicit_euler_clamped").expect("an integrator");
    let network = sheet(side, 0.02, &sheet_rules(1e4, 0.0), 1e-3);
    Scene::new(network, 1.0 / 60.0).by(method).under([0.0, 0.0, 9.81])
}

#[test]
fn gravity_acts_however_early_a_solve_stops() {
    let mut before = 0.05;
    for cap in [1, 2, 3, 5, 8] {
        let mut scene = stiff_sheet(30);
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-6, max_iterations: cap };
        scene.settings.solver.preconditioner = PreconditionerKind::Identity;
        let mut simulation = scene.simulate(Precision::F64);
        let solve = advance(&mut simulation, 1).solve.expect("an implicit step solves");
        assert_eq!((solve.outcome, solve.iterations), (Outcome::IterationCap, cap));
        assert!(solve.relative_residual > 1.0, "0 would have a smaller residual: {solve:?}");

        // Beside that of a free fall: the longer it is solved, the farther the pins are from most of it.
        let v = velocities(&simulation);
        let mean = v.iter().map(|v| v[2]).sum::<f64>() / v.len() as f64 / (9.81 / 60.0);
        assert!(
            mean > before,
            "after {cap} iterations it falls at {mean} of a free fall, before at {before}"
        );
        before = mean;
    }
}

#[test]
fn more_iterations_than_binary32_can_use_are_neither_made_nor_a_failure() {
    for count in [80, 100, 200, 400] {
        let mut scene = stiff_sheet(60);
        // Soft enough for 200 iterations to bring it to rounding.
        scene.network.springs.iter_mut().for_each(|spring| spring.law.stiffness = 50.0);
        scene.settings.solver.stop = Stop::Iterations(count);
        let mut simulation = scene.simulate(Precision::F32);
        for _ in 0..3 {
            let solve = advance(&mut simulation, 1).solve.expect("an implicit step solves");
            assert!(
                solve.iterations < 200 && solve.relative_residual < 1e-3,
                "{count} iterations asked: {solve:?}"
            );
            assert_eq!(solve.outcome == Outcome::IterationCap, solve.iterations == count, "{solve:?}");
        }
        assert!(positions(&simulation).iter().flatten().all(|x| x.is_finite()));
    }
}

#[test]
fn the_residual_of_a_solve_that_converged_is_that_of_its_solution() {
    let system = System::named("spd_ill_conditioned");
    let a = BlockCsr::<f32>::from_dense(&system.a);
    let b: Vec<Vec3<f32>> =
        system.b.as_chunks::<3>().0.iter().map(|b| Vec3::from(*b).map(|c| c as f32)).collect();
    for tolerance in [1e-3, 1e-5, 1e-7] {
        let stop = Stop::Residual { tolerance, max_iterations: 1000 };
        let settings = SolverSettings { stop, ..SolverSettings::default() };
        let rows = Sixteen::from_vectors(&b);
        let mut x = vec![Sixteen::default(); rows.len()];
        let mut work = CgWorkspace::new(b.len(), 32);
        let share = Share::whole(b.len(), 32);
        let report = conjugate_gradient(&a, &Identity, &rows, &mut x, &settings, &share, &mut work);
        assert_eq!(report.outcome, Outcome::Converged, "{tolerance:e}: {report:?}");

        // b - A x in the same arithmetic: the recursion comes to much less.
        let padded: Vec<_> =
            Sixteen::to_vectors(&x, Sixteen::<f32>::LANES * x.len()).iter().map(Padded::new).collect();
        let mut product = vec![Sixteen::default(); x.len()];
        a.apply(0, &padded, &mut product);
        let product = Sixteen::to_vectors(&product, b.len());
        let squares = |v: Vec3<f32>| v.iter().map(|c| f64::from(*c).powi(2)).sum::<f64>();
        let residual: f64 = b.iter().zip(&product).map(|(b, q)| squares(b - q)).sum();
        let found = (residual / b.iter().map(|b| squares(*b)).sum::<f64>()).sqrt();
        let reported = report.relative_residual;
        assert!(
            (reported / found - 1.0).abs() < 1e-9,
            "{tolerance:e}: {reported:e} reported, {found:e} found"
        );
    }
}

#[test]
fn a_solve_stops_at_its_floor_whatever_the_tolerance() {
    let mut scene = stiff_sheet(12);
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-9, max_iterations: 600 };
    let solved = |floor: f64| {
        let mut scene = scene.clone();
        scene.settings.solver.floor = floor;
        advance(&mut scene.simulate(Precision::F64), 1).solve.expect("an implicit step solves")
    };
    let whole = solved(0.0);
    assert!(whole.outcome == Outcome::Converged && whole.iterations > 0, "{whole:?}");
    // |b| is the residual over its share.
    let start = whole.residual / whole.relative_residual;
    let early = solved(1e-3 * start);
    assert_eq!(early.outcome, Outcome::Converged);
    assert!(early.iterations < whole.iterations && early.residual <= 1e-3 * start, "{early:?}, {whole:?}");
    let none = solved(2.0 * start);
    assert_eq!((none.outcome, none.iterations), (Outcome::Converged, 0));
}

/// Minus the identity in some rows.
struct Turned {
    from: usize,
}

impl Preconditioner<f64> for Turned {
    fn apply(&self, first_row: usize, r: &[Sixteen<f64>], z: &mut [Sixteen<f64>]) {
        let lanes = Sixteen::<f64>::LANES;
        for row in 0..lanes * r.len() {
            let own = r[row / lanes].get(row % lanes);
            z[row / lanes].set(row % lanes, if first_row + row < self.from { own } else { -own });
        }
    }
}

#[test]
fn a_preconditioner_that_is_not_positive_definite_is_named() {
    // The second difference of a chain: the residual moves from its first row to the others.
    let count = 4;
    let rows: Vec<Vec<f64>> = (0..3 * count)
        .map(|i: usize| {
            (0..3 * count)
                .map(|j: usize| match i.abs_diff(j) {
                    0 => 2.0,
                    3 => -1.0,
                    _ => 0.0,
                })
                .collect()
        })
        .collect();
    let a = BlockCsr::<f64>::from_dense(&rows);
    let mut b = vec![Vec3::zeros(); count];
    b[0] = Vec3::new(1.0, 0.0, 0.0);
    for (from, iteration) in [(0, 0), (1, 1)] {
        let rows = Sixteen::from_vectors(&b);
        let (mut x, mut work) = (vec![Sixteen::default(); rows.len()], CgWorkspace::new(count, 32));
        let settings = SolverSettings::default();
        let share = Share::whole(count, 32);
        let report = conjugate_gradient(&a, &Turned { from }, &rows, &mut x, &settings, &share, &mut work);
        assert_eq!(report.outcome, Outcome::IndefinitePreconditioner { iteration }, "{report:?}");
        assert_eq!(report.iterations, iteration);
        assert_eq!(x[0].get(0).x > 0.0, iteration > 0, "the last iterate: {x:?}");
    }
}

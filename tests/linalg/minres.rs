//! Minimal residuals on systems solved in 60 digits, on dense ones, and on ones that must fail.

use nappe_sim::{
    linalg::{MinresWorkspace, Outcome, SolveReport, Stop, WholeOperator, minres},
    math::{Real, Vec3, array3, vec3},
};
use nappe_tests::{
    systems::{System, distance, size},
    threads::{THREAD_COUNTS, with_threads},
};

use super::dense::{Case, eliminate, matrix, negative_eigenvalues, noise, plus, times};

const TIGHT: Stop = Stop::Residual { tolerance: 1e-12, max_iterations: 1000 };

fn finite(x: &[f64]) -> bool {
    x.iter().all(|c| c.is_finite())
}

#[test]
fn every_regular_system_gets_its_exact_solution_whatever_the_signs_of_its_eigenvalues() {
    let mut solved = 0;
    for system in System::all() {
        let Some(expected) = &system.x_exact else { continue };

        // Rounding of b - A x alone is up to this.
        let tolerance = 1e-12_f64.max(1e-16 * system.condition());
        let stop = Stop::Residual { tolerance, max_iterations: 200 };
        let (report, x) = Case::of(&system).solve::<f64>(stop);
        let label = format!("{}: {report:?}", system.name);
        assert_eq!(report.outcome, Outcome::Converged, "{label}");
        let error = distance(&x, expected);
        let tolerance = 4.0 * tolerance * system.condition() * size(expected);
        assert!(error <= tolerance, "{label}: off by {error:e} of {tolerance:e}");

        // In exact arithmetic, as many as there are unknowns.
        let exact = system.b.len() as u32;
        assert!(report.iterations <= exact + 1 || system.condition() > 1e4, "{label}");
        solved += 1;
    }

    assert_eq!(solved, 11);
}

#[test]
fn every_regular_system_is_solved_in_binary32_as_far_as_it_can_be() {
    for system in System::all() {
        let (Some(expected), true) = (&system.x_exact, system.condition() < 1e3) else { continue };
        let stop = Stop::Residual { tolerance: 1e-5, max_iterations: 200 };
        let (report, x) = Case::of(&system).solve::<f32>(stop);
        let label = format!("{}: {report:?}", system.name);
        assert_eq!(report.outcome, Outcome::Converged, "{label}");
        let error = distance(&x, expected);
        let tolerance = 2e-5 * system.condition() * size(expected);
        assert!(error <= tolerance, "{label}: off by {error:e} of {tolerance:e}");
    }
}

#[test]
fn a_singular_system_is_solved_where_it_can_be_and_named_where_it_cannot() {
    let consistent = System::named("singular_consistent");
    let (report, x) = Case::of(&consistent).solve::<f64>(TIGHT);
    assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
    assert!(consistent.residual(&x) <= 1e-12);

    let system = System::named("singular_inconsistent");
    let case = Case::of(&system);
    let (report, x) = case.solve::<f64>(TIGHT);
    assert!(matches!(report.outcome, Outcome::Singular { .. }), "{report:?}");

    // Least squares: A r = 0.
    let rest = plus(&case.b, -1.0, &times(&case.a, &x));
    let share = size(&rest) / size(&case.b);
    assert!(size(&times(&case.a, &rest)) < 1e-12 && share > 0.1, "{report:?}: {x:?}");
    assert!((report.relative_residual - share).abs() < 1e-12, "{report:?}");
}

#[test]
fn a_right_hand_side_of_zero_is_answered_with_zero_at_once() {
    let case = Case::of(&System::named("spd_rhs_zero"));
    let (report, x) = case.solve_from::<f64>(&[1.0, 2.0, 3.0], TIGHT);
    let SolveReport { outcome, iterations, products, relative_residual, .. } = report;
    assert_eq!((outcome, iterations, products, relative_residual), (Outcome::Converged, 0, 0, 0.0));
    assert_eq!(x, [0.0; 3]);
}

#[test]
fn after_every_iteration_the_residual_is_the_smallest_that_there_is() {
    let cases = System::all().into_iter().filter(|s| size(&s.b) > 0.0 && s.condition() < 1e3);
    let all = cases.map(|s| Case::of(&s)).chain([Case::dense(0.02), Case::dense(0.2)]);
    for (number, case) in all.enumerate() {
        for (i, least) in case.least_residuals(12.min(case.b.len())).iter().enumerate() {
            let count = i as u32 + 1;
            let (report, x) = case.solve::<f64>(Stop::Iterations(count));
            let found = report.relative_residual;

            // What rounding leaves where the residual has run out.
            assert!((found - least).abs() < 1e-8, "case {number}, {count}: {report:?}, least {least:e}");
            assert!((found - case.residual(&x)).abs() < 1e-13, "case {number}, {count}: {report:?}");
        }
    }
}

#[test]
fn a_dense_system_of_fifty_nodes_is_solved_as_by_elimination() {
    for (size_of_part, is_definite) in [(0.02, true), (0.2, false)] {
        let case = Case::dense(size_of_part);
        let (a, b) = case.scaled();
        let negative = negative_eigenvalues(&a);
        assert_eq!(negative == 0, is_definite, "{negative} negative eigenvalues");
        let exact = eliminate(&a, &b);
        let error = |x: &[f64]| distance(&case.weigh(x, 1), &exact) / size(&exact);

        let stop = Stop::Residual { tolerance: 1e-13, max_iterations: 1000 };
        let (report, x) = case.solve::<f64>(stop);
        assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
        assert!(error(&x) < 1e-10, "{negative} negative eigenvalues: off by {:e}, {report:?}", error(&x));

        let stop = Stop::Residual { tolerance: 1e-5, max_iterations: 1000 };
        let (report, x) = case.solve::<f32>(stop);
        assert_eq!(report.outcome, Outcome::Converged, "{report:?}");

        // Entries of A are rounded, 150 in each row.
        let found = case.residual(&x);
        assert!(found < 2e-5, "{negative} negative eigenvalues: residual {found:e}, {report:?}");
        assert!(error(&x) < 1e-3, "{negative} negative eigenvalues: off by {:e}, {report:?}", error(&x));
    }
}

#[test]
fn a_start_at_the_solution_costs_no_iteration() {
    let case = Case::dense(0.2);
    let (cold, x) = case.solve::<f64>(TIGHT);
    let near = Stop::Residual { tolerance: 1e-11, max_iterations: 1000 };
    let (warm, same) = case.solve_from::<f64>(&x, near);
    assert!(cold.iterations > 10 && warm.iterations == 0, "{cold:?}, {warm:?}");
    assert_eq!(x, same);
}

#[test]
fn rows_without_mass_are_left_out() {
    let whole = Case::dense(0.2);
    let mut case = Case { a: whole.a.clone(), mass: whole.mass.clone(), b: whole.b.clone() };
    let gone = [3, 17, 49];
    for i in gone {
        case.mass[i] = 0.0;
    }

    let (report, x) = case.solve_from::<f64>(&vec![0.5; 150], TIGHT);
    assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
    let kept: Vec<usize> = (0..150).filter(|i| !gone.contains(&(i / 3))).collect();
    let a = matrix(kept.len(), |i, j| whole.a[kept[i]][kept[j]]);
    let pick = |from: &[f64]| kept.iter().map(|i| from[*i]).collect::<Vec<_>>();
    let exact = eliminate(&a, &pick(&whole.b));
    let error = distance(&pick(&x), &exact) / size(&exact);
    assert!(error < 1e-9, "off by {error:e}, {report:?}");
    assert!(gone.iter().all(|i| x[3 * i..3 * i + 3] == [0.0; 3]));
}

/// `M + c L` on a chain of nodes, L of springs some of which push: indefinite, over many blocks.
struct Chain {
    mass: Vec<f64>,
    stiffness: Vec<f64>,
}

impl Chain {
    fn new(count: usize) -> Self {
        let mass = noise(3, count).iter().map(|part| 1.5 + part).collect();
        let pushing = |(i, part): (usize, &f64)| if i % 5 == 0 { -6.0 } else { 1.0 + 0.5 * part };
        let stiffness = noise(5, count).iter().enumerate().map(pushing).collect();
        Self { mass, stiffness }
    }

    fn solve<R: Real>(&self, work: &mut MinresWorkspace<R>) -> (SolveReport, Vec<Vec3<R>>) {
        let count = self.mass.len();
        let mass: Vec<R> = self.mass.iter().map(|m| R::of(*m)).collect();
        let b: Vec<Vec3<R>> = noise(7, 3 * count).as_chunks().0.iter().map(|b| vec3(*b)).collect();
        let mut x = vec![Vec3::zeros(); count];
        let stop = Stop::Residual { tolerance: 1e-5, max_iterations: 300 };
        let mut operator = self;
        (minres(&mut operator, &mass, &b, &mut x, stop, work), x)
    }
}

impl<R: Real> WholeOperator<R> for &Chain {
    fn apply(&mut self, x: &[Vec3<R>], out: &mut [Vec3<R>]) {
        for (i, out) in out.iter_mut().enumerate() {
            *out = x[i] * R::of(self.mass[i]);
            if i > 0 {
                *out += (x[i] - x[i - 1]) * R::of(self.stiffness[i - 1]);
            }
            if i + 1 < x.len() {
                *out += (x[i] - x[i + 1]) * R::of(self.stiffness[i]);
            }
        }
    }
}

fn same_bits_for_any_number_of_threads<R: Real>() {
    let chain = Chain::new(5003);
    let solve = |threads| with_threads(threads, || chain.solve::<R>(&mut MinresWorkspace::default()));
    let expected = solve(1);
    assert_eq!(expected.0.outcome, Outcome::Converged, "{:?}", expected.0);
    assert!(expected.0.iterations > 5, "{:?}", expected.0);
    for threads in THREAD_COUNTS {
        assert!(solve(threads) == expected, "{threads} threads in {}", R::PRECISION);
    }
}

#[test]
fn a_solve_has_the_same_bits_for_any_number_of_threads() {
    same_bits_for_any_number_of_threads::<f32>();
    same_bits_for_any_number_of_threads::<f64>();
}

#[test]
fn what_a_workspace_held_before_plays_no_part() {
    let mut work = MinresWorkspace::default();
    let [large, small] = [Chain::new(3000), Chain::new(700)];
    let fresh = small.solve::<f64>(&mut MinresWorkspace::default());
    large.solve(&mut work);
    assert!(small.solve(&mut work) == fresh);

    // Nor what a failed solve left.
    let bad = Chain { mass: vec![f64::NAN; 3000], stiffness: vec![0.0; 3000] };
    bad.solve(&mut work);
    assert!(small.solve(&mut work) == fresh);
    let again = large.solve::<f64>(&mut MinresWorkspace::default());
    assert!(large.solve(&mut work) == again);
}

/// Answers as the matrix does, until a product that it spoils.
struct Spoiled<R> {
    chain: Chain,
    products: u32,
    bad: R,
}

impl<R: Real> WholeOperator<R> for Spoiled<R> {
    fn apply(&mut self, x: &[Vec3<R>], out: &mut [Vec3<R>]) {
        (&self.chain).apply(x, out);
        if self.products == 0 {
            out[3].y = self.bad;
        }

        self.products = self.products.saturating_sub(1);
    }
}

fn failed_products_leave_the_last_finite_iterate<R: Real>() {
    let b = vec![Vec3::repeat(R::one()); 40];
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for products in 0..4 {
            let mut operator = Spoiled { chain: Chain::new(40), products, bad: R::of(bad) };
            let mass: Vec<R> = operator.chain.mass.iter().map(|m| R::of(*m)).collect();
            let mut x = vec![Vec3::zeros(); 40];
            let report = minres(&mut operator, &mass, &b, &mut x, TIGHT, &mut MinresWorkspace::default());
            let label = format!("{bad} in product {products}: {report:?}");
            assert_eq!(report.outcome, Outcome::NotFinite { iteration: products + 1 }, "{label}");
            assert!(x.iter().all(|x| finite(&array3(x))), "{label}");
            assert!(report.relative_residual <= 1.0 && report.iterations == products, "{label}");
        }
    }
}

#[test]
fn a_product_that_is_not_finite_leaves_the_last_finite_iterate() {
    failed_products_leave_the_last_finite_iterate::<f32>();
    failed_products_leave_the_last_finite_iterate::<f64>();
}

#[test]
fn numbers_that_leave_the_range_are_named_and_not_returned() {
    let identity = |size: f64| matrix(3, |i, j| if i == j { size } else { 0.0 });
    let solve = |size: f64, b: f64, start: f64| {
        let case = Case { a: identity(size), mass: vec![1.0], b: vec![b, 0.0, 0.0] };
        case.solve_from::<f32>(&[start; 3], TIGHT)
    };

    for (size, b, start) in [(1.0, f64::NAN, 2.0), (1.0, f64::INFINITY, 2.0), (1.0, 1.0, f64::INFINITY)] {
        let (report, x) = solve(size, b, start);
        assert_eq!(report.outcome, Outcome::NotFinite { iteration: 0 }, "{report:?}");
        assert_eq!(x, [start; 3]);
    }

    // The solution itself is out of binary32's range.
    let (report, x) = solve(1e-30, 1e30, 0.0);
    assert_eq!(report.outcome, Outcome::NotFinite { iteration: 1 }, "{report:?}");
    assert_eq!(x, [0.0; 3]);
}

#[test]
fn a_solve_stops_at_its_cap_and_never_returns_worse_than_its_start() {
    let case = Case::of(&System::named("spd_ill_conditioned"));
    let mut before = 1.0;
    for cap in 1..=9 {
        let stop = Stop::Residual { tolerance: 1e-12, max_iterations: cap };
        let (report, x) = case.solve::<f64>(stop);
        assert_eq!((report.outcome, report.iterations), (Outcome::IterationCap, cap));
        let found = case.residual(&x);
        assert!((report.relative_residual - found).abs() < 1e-12 && found <= before, "{report:?}");
        before = found;
    }

    // A tolerance that binary32 cannot meet.
    let stop = Stop::Residual { tolerance: 1e-12, max_iterations: 500 };
    let (report, x) = case.solve::<f32>(stop);
    assert_eq!(report.outcome, Outcome::IterationCap, "{report:?}");
    assert!(case.residual(&x) < 1e-2 && finite(&x), "{report:?}");
}

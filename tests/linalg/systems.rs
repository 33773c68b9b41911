//! Conjugate gradient on small systems with known outcomes: definite, indefinite, singular.

use nappe_sim::linalg::{Outcome, PreconditionerKind, SolveReport, Stop};
use nappe_tests::systems::{System, distance, size};

const TIGHT: Stop = Stop::Residual { tolerance: 1e-12, max_iterations: 200 };

/// Whether exact arithmetic meets a curvature that is not positive before it converges.
fn is_bad(system: &System) -> bool {
    system.exact.first_bad.is_some()
}

#[test]
fn every_system_ends_with_its_status_at_its_iteration() {
    for system in System::all() {
        let (report, x) = system.solve::<f64>(PreconditionerKind::Identity, TIGHT);
        let label = format!("{}: {report:?}", system.name);
        assert!(x.iter().all(|c| c.is_finite()), "{label}: {x:?}");
        if let Some(first_bad) = system.exact.first_bad {
            let found = match report.outcome {
                Outcome::NegativeCurvature { iteration } => ("negative", iteration),
                Outcome::ZeroCurvature { iteration } => ("zero", iteration),
                Outcome::Singular { iteration } => ("singular", iteration),
                _ => panic!("{label}"),
            };

            let expected = match system.name.as_str() {
                "breakdown_exact_zero" => "zero",
                "singular_inconsistent" => "singular",
                _ => "negative",
            };

            assert_eq!(found.0, expected, "{label}");

            // The table counts iterations from 0, the program from 1.
            assert!(found.1.abs_diff(first_bad + 1) <= 1, "{label}: exact arithmetic says {}", first_bad + 1);
        } else {
            assert_eq!(system.exact.status, "converged", "{label}");
            assert_eq!(report.outcome, Outcome::Converged, "{label}");

            // Rounding costs iterations only where the condition number does.
            if system.condition() < 1e4 || !system.condition().is_finite() {
                assert!(report.iterations.abs_diff(system.exact.iterations) <= 1, "{label}");
            }
        }
    }
}

#[test]
fn every_definite_system_gets_its_exact_solution_from_every_preconditioner() {
    for system in System::all().iter().filter(|s| !is_bad(s) && s.x_exact.is_some()) {
        let expected = system.x_exact.as_ref().expect("a regular system has a solution");
        for kind in
            [PreconditionerKind::Identity, PreconditionerKind::Diagonal, PreconditionerKind::BlockJacobi]
        {
            if system.name == "indef_benign_rhs" && kind != PreconditionerKind::Identity {
                // Scaling moves the right-hand side onto the negative modes.
                continue;
            }
            let (report, x) = system.solve::<f64>(kind, TIGHT);
            let label = format!("{} with {}: {report:?}", system.name, kind.name());
            assert_eq!(report.outcome, Outcome::Converged, "{label}");
            let error = distance(&x, expected);
            let tolerance = 4e-12 * system.condition() * size(expected);
            assert!(error <= tolerance, "{label}: off by {error:e} of {tolerance:e}");
        }
    }
}

#[test]
fn every_definite_system_is_solved_in_binary32_as_far_as_it_can_be() {
    for system in System::all().iter().filter(|s| !is_bad(s) && s.condition() < 1e3) {
        let expected = system.x_exact.as_ref().expect("a regular system has a solution");
        let stop = Stop::Residual { tolerance: 1e-5, max_iterations: 200 };
        let (report, x) = system.solve::<f32>(PreconditionerKind::Identity, stop);
        let label = format!("{}: {report:?}", system.name);
        assert_eq!(report.outcome, Outcome::Converged, "{label}");
        let error = distance(&x, expected);
        let tolerance = 2e-5 * system.condition() * size(expected);
        assert!(error <= tolerance, "{label}: off by {error:e} of {tolerance:e}");
    }
}

#[test]
fn residuals_fall_as_in_exact_arithmetic() {
    for system in System::all().iter().filter(|s| !is_bad(s) && s.condition() < 1e3) {
        let histories = [
            (PreconditionerKind::Identity, Some(&system.exact.residual_norms)),
            (PreconditionerKind::BlockJacobi, system.block_jacobi_pcg_residual_norms.as_ref()),
        ];
        for (kind, norms) in histories {
            let Some(norms) = norms else { continue };
            for (count, norm) in norms.iter().enumerate().skip(1) {
                let (report, x) = system.solve::<f64>(kind, Stop::Iterations(count as u32));
                let expected = norm / norms[0];
                let label = format!("{} with {}, {count} iterations", system.name, kind.name());

                // What rounding leaves after a dozen iterations at condition numbers below 10.
                let allowed = 1e-6 * expected + 1e-12;
                assert!((system.residual(&x) - expected).abs() <= allowed, "{label}: recomputed");

                // Its own norm is that of the table where nothing preconditions.
                let is_preconditioned = kind == PreconditionerKind::BlockJacobi;
                let own = if is_preconditioned { system.natural_residual(&x) } else { expected };
                let error = (report.relative_residual - own).abs();
                assert!(error <= 1e-6 * own + 1e-12, "{label}: {} not {own:e}", report.relative_residual);
            }
        }
    }
}

#[test]
fn a_right_hand_side_of_zero_is_answered_with_zero_at_once() {
    let (report, x) = System::named("spd_rhs_zero").solve::<f64>(PreconditionerKind::Identity, TIGHT);
    let SolveReport { outcome, iterations, products, relative_residual, .. } = report;
    assert_eq!((outcome, iterations, products, relative_residual), (Outcome::Converged, 0, 0, 0.0));
    assert!(x.iter().all(|c| *c == 0.0));
}

#[test]
fn a_solve_that_meets_bad_curvature_returns_its_last_iterate() {
    for system in System::all().iter().filter(|s| is_bad(s)) {
        let (report, x) = system.solve::<f64>(PreconditionerKind::Identity, TIGHT);
        let norms = &system.exact.residual_norms;
        let first_bad = system.exact.first_bad.expect("bad") as usize;
        if first_bad > 0 {
            let last = norms[first_bad] / norms[0];
            let found = system.residual(&x);
            assert!(
                (found - last).abs() < 1e-9 * last.max(1.0),
                "{}: residual {found}, not {last}",
                system.name
            );
            assert!((report.relative_residual - found).abs() < 1e-12, "{}: {report:?}", system.name);
            continue;
        }

        // From 0: along b, by b.b over the magnitudes of the terms of b^T A b.
        let product = |row: &Vec<f64>| row.iter().zip(&system.b).map(|(a, b)| a * b).sum::<f64>();
        let terms = system.a.iter().zip(&system.b).map(|(row, b)| (b * product(row)).abs());
        let length = system.b.iter().map(|b| b * b).sum::<f64>() / terms.sum::<f64>();
        let expected: Vec<f64> = system.b.iter().map(|b| length * b).collect();
        let error = distance(&x, &expected);
        assert!(error < 1e-13 * size(&expected), "{}: {x:?}, not {expected:?}", system.name);
    }
}

#[test]
fn a_preconditioned_solve_whose_first_direction_is_bad_goes_along_it() {
    let mut count = 0;
    for system in System::all() {
        let (report, x) = system.solve::<f64>(PreconditionerKind::Diagonal, TIGHT);
        let is_first = matches!(
            report.outcome,
            Outcome::NegativeCurvature { iteration: 1 } | Outcome::ZeroCurvature { iteration: 1 }
        );
        if !is_first {
            continue;
        }

        // z = M⁻¹ b, by b.z over the magnitudes of the terms of z^T A z.
        let z: Vec<f64> = (0..system.b.len())
            .map(|i| {
                let block = 3 * (i / 3)..3 * (i / 3) + 3;
                let is_positive = block.clone().all(|k| system.a[k][k] > 0.0);
                if is_positive { system.b[i] / system.a[i][i] } else { system.b[i] }
            })
            .collect();
        let product = |row: &Vec<f64>| row.iter().zip(&z).map(|(a, z)| a * z).sum::<f64>();
        let terms: f64 = system.a.iter().zip(&z).map(|(row, z)| (z * product(row)).abs()).sum();
        let length = system.b.iter().zip(&z).map(|(b, z)| b * z).sum::<f64>() / terms;
        let expected: Vec<f64> = z.iter().map(|z| length * z).collect();
        let error = distance(&x, &expected);
        assert!(error < 1e-6 * size(&expected), "{}: {x:?}, not {expected:?}", system.name);
        count += 1;
    }
    assert!(count > 0, "some system has a bad first direction");
}

#[test]
fn a_solve_stops_at_its_cap_with_its_last_iterate() {
    let system = System::named("spd_ill_conditioned");
    let norms = &system.exact.residual_norms;
    for cap in 1..=9_u32 {
        let stop = Stop::Residual { tolerance: 1e-12, max_iterations: cap };
        let (report, x) = system.solve::<f64>(PreconditionerKind::Identity, stop);
        assert_eq!((report.outcome, report.iterations), (Outcome::IterationCap, cap));
        let last = norms[cap as usize] / norms[0];
        let found = system.residual(&x);
        assert!((found / last - 1.0).abs() < 1e-3, "after {cap}: residual {found}, not {last}");
    }
}

#[test]
fn a_fixed_number_of_iterations_is_made_before_rounding_ends_it() {
    let system = System::named("spd_tetra_stretched");
    for count in 1..=10 {
        let (report, _) = system.solve::<f64>(PreconditionerKind::Identity, Stop::Iterations(count));
        assert_eq!((report.outcome, report.iterations), (Outcome::IterationCap, count));
    }
}

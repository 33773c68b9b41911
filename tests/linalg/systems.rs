//! Conjugate gradient on small systems with known outcomes: definite, indefinite, singular.

use nappe_sim::{
    linalg::{
        BlockCsr, BlockJacobi, CgWorkspace, Identity, Inverse3, Outcome, Preconditioner, PreconditionerKind,
        SolveReport, SolverSettings, Stop, Symmetric3, conjugate_gradient,
    },
    math::{Mat3, Real, Sixteen, Vec3, vec3},
};
use nappe_tests::golden::document;
use serde::Deserialize;

#[derive(Deserialize)]
struct Systems {
    systems: Vec<System>,
}

#[derive(Deserialize)]
pub(super) struct System {
    pub(super) name: String,
    #[serde(rename = "A")]
    pub(super) a: Vec<Vec<f64>>,
    pub(super) b: Vec<f64>,
    eigenvalues: Vec<f64>,
    pub(super) x_exact: Option<Vec<f64>>,
    #[serde(rename = "cg_exact_arithmetic")]
    exact: Exact,
    block_jacobi_pcg_residual_norms: Option<Vec<f64>>,
}

#[derive(Deserialize)]
struct Exact {
    status: String,
    iterations: u32,
    residual_norms: Vec<f64>,
    #[serde(rename = "first_iteration_with_pAp_le_0")]
    first_bad: Option<u32>,
}

impl System {
    pub(super) fn all() -> Vec<Self> {
        document::<Systems>("linalg/cg_systems.json").systems
    }

    pub(super) fn named(name: &str) -> Self {
        Self::all()
            .into_iter()
            .find(|s| s.name == name)
            .unwrap_or_else(|| panic!("no system is named {name}"))
    }

    fn diagonal_block(&self, i: usize) -> Symmetric3 {
        let at = |a: usize, b: usize| self.a[3 * i + a][3 * i + b];
        Symmetric3 { xx: at(0, 0), yy: at(1, 1), zz: at(2, 2), xy: at(0, 1), xz: at(0, 2), yz: at(1, 2) }
    }

    /// Solves from 0; gives the solution too.
    fn solve<R: Real>(&self, kind: PreconditionerKind, stop: Stop) -> (SolveReport, Vec<f64>) {
        let a = BlockCsr::<R>::from_dense(&self.a);
        let b: Vec<Vec3<R>> = self.b.as_chunks::<3>().0.iter().map(|b| vec3(*b)).collect();
        let count = b.len();
        let b = Sixteen::from_vectors(&b);
        let mut x = vec![Sixteen::default(); b.len()];
        let settings = SolverSettings { stop, preconditioner: kind, ..SolverSettings::default() };
        let (block_size, mut work) = (32, CgWorkspace::new(count, 32));
        let blocks: Vec<_> = (0..count).map(|i| self.diagonal_block(i)).collect();
        let inverse = Inverse3::of(&blocks, kind, 1.0);
        let jacobi = BlockJacobi(&inverse);
        let m: &dyn Preconditioner<R> =
            if kind == PreconditionerKind::Identity { &Identity } else { &jacobi };
        let report = conjugate_gradient(&a, m, &b, &mut x, &settings, block_size, &mut work);

        let x = Sixteen::to_vectors(&x, count);
        (report, x.iter().flat_map(|x| x.iter().map(|c| c.to_f64()).collect::<Vec<_>>()).collect())
    }

    /// |b - A x| / |b|, recomputed.
    pub(super) fn residual(&self, x: &[f64]) -> f64 {
        let row = |(row, b): (&Vec<f64>, &f64)| b - row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        size(&self.a.iter().zip(&self.b).map(row).collect::<Vec<_>>()) / size(&self.b)
    }

    /// sqrt(r.z / b.c) of r = b - A x, with z = M⁻¹ r and c = M⁻¹ b, M the diagonal blocks of A.
    fn natural_residual(&self, x: &[f64]) -> f64 {
        let row = |(row, b): (&Vec<f64>, &f64)| b - row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        let r: Vec<f64> = self.a.iter().zip(&self.b).map(row).collect();
        let square = |r: &[f64]| {
            let block = |(i, r): (usize, &[f64; 3])| {
                let block = Mat3::from_fn(|c, d| self.a[3 * i + c][3 * i + d]);
                let r = Vec3::from(*r);
                r.dot(&block.lu().solve(&r).expect("a block is regular"))
            };
            r.as_chunks::<3>().0.iter().enumerate().map(block).sum::<f64>()
        };
        (square(&r) / square(&self.b)).sqrt()
    }

    pub(super) fn condition(&self) -> f64 {
        let magnitude = |e: &f64| e.abs();
        let sizes = || self.eigenvalues.iter().map(magnitude);
        sizes().fold(0.0, f64::max) / sizes().fold(f64::INFINITY, f64::min)
    }
}

pub(super) fn size(v: &[f64]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    size(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}

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
    assert_eq!(
        report,
        SolveReport { outcome: Outcome::Converged, iterations: 0, products: 0, relative_residual: 0.0 }
    );
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

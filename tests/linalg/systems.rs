//! Conjugate gradient on small systems with known outcomes: definite, indefinite, singular.

use nappe_sim::{
    linalg::{
        BlockCsr, BlockJacobi, CgWorkspace, Diagonal, Identity, Outcome, PreconditionerKind, SolveReport,
        SolverSettings, Stop, Symmetric3, conjugate_gradient,
    },
    math::{Real, Vec3, vec3},
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

    fn diagonal_block(&self, i: usize) -> Symmetric3<f64> {
        let at = |a: usize, b: usize| self.a[3 * i + a][3 * i + b];
        Symmetric3 { xx: at(0, 0), yy: at(1, 1), zz: at(2, 2), xy: at(0, 1), xz: at(0, 2), yz: at(1, 2) }
    }

    /// Solves from 0; gives the solution too.
    fn solve<R: Real>(&self, kind: PreconditionerKind, stop: Stop) -> (SolveReport, Vec<f64>) {
        let a = BlockCsr::<R>::from_dense(&self.a);
        let b: Vec<Vec3<R>> = self.b.as_chunks::<3>().0.iter().map(|b| vec3(*b)).collect();
        let mut x = vec![Vec3::zeros(); b.len()];
        let settings = SolverSettings { stop, preconditioner: kind, ..SolverSettings::default() };
        let (block_size, mut work) = (32, CgWorkspace::new(b.len(), 32));
        let inverse = |invert: fn(&Symmetric3<R>) -> Option<Symmetric3<R>>| -> Vec<Symmetric3<R>> {
            let block = |i| {
                let d: Symmetric3<f64> = self.diagonal_block(i);
                let d = [d.xx, d.yy, d.zz, d.xy, d.xz, d.yz].map(R::of);
                let d = Symmetric3 { xx: d[0], yy: d[1], zz: d[2], xy: d[3], xz: d[4], yz: d[5] };
                invert(&d).unwrap_or(Symmetric3::scalar(R::one()))
            };

            (0..b.len()).map(block).collect()
        };

        let (x_mut, work) = (&mut x[..], &mut work);
        let report = match kind {
            PreconditionerKind::Identity => {
                conjugate_gradient(&a, &Identity, &b, x_mut, &settings, block_size, work)
            }
            PreconditionerKind::Diagonal => {
                let inverse = inverse(Symmetric3::inverse_diagonal);
                conjugate_gradient(&a, &Diagonal(&inverse), &b, x_mut, &settings, block_size, work)
            }
            PreconditionerKind::BlockJacobi => {
                let inverse = inverse(Symmetric3::inverse_if_positive);
                conjugate_gradient(&a, &BlockJacobi(&inverse), &b, x_mut, &settings, block_size, work)
            }
        };

        (report, x.iter().flat_map(|x| x.iter().map(|c| c.to_f64()).collect::<Vec<_>>()).collect())
    }

    /// |b - A x| / |b|, recomputed.
    pub(super) fn residual(&self, x: &[f64]) -> f64 {
        let row = |(row, b): (&Vec<f64>, &f64)| b - row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        size(&self.a.iter().zip(&self.b).map(row).collect::<Vec<_>>()) / size(&self.b)
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
                Outcome::Converged | Outcome::IterationCap | Outcome::NotFinite { .. } => panic!("{label}"),
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
        for kind in PreconditionerKind::ALL {
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
                let error = (report.relative_residual - expected).abs();
                assert!(error <= allowed, "{label}: {} not {expected:e}", report.relative_residual);
                assert!((system.residual(&x) - expected).abs() <= allowed, "{label}: recomputed");
            }
        }
    }
}

#[test]
fn a_right_hand_side_of_zero_is_answered_with_zero_at_once() {
    let (report, x) = System::named("spd_rhs_zero").solve::<f64>(PreconditionerKind::Identity, TIGHT);
    assert_eq!(report, SolveReport { outcome: Outcome::Converged, iterations: 0, relative_residual: 0.0 });
    assert!(x.iter().all(|c| *c == 0.0));
}

#[test]
fn a_solve_that_meets_bad_curvature_returns_its_best_iterate() {
    for system in System::all().iter().filter(|s| is_bad(s)) {
        let (report, x) = system.solve::<f64>(PreconditionerKind::Identity, TIGHT);
        let before = &system.exact.residual_norms[..=system.exact.first_bad.expect("bad") as usize];
        let best = before.iter().copied().fold(f64::INFINITY, f64::min) / before[0];
        let found = system.residual(&x);
        assert!((found - best).abs() < 1e-9 * best.max(1.0), "{}: residual {found}, not {best}", system.name);
        assert!((report.relative_residual - found).abs() < 1e-12, "{}: {report:?}", system.name);
    }
}

#[test]
fn a_solve_stops_at_its_cap_with_its_best_iterate() {
    let system = System::named("spd_ill_conditioned");
    let norms = &system.exact.residual_norms;
    for cap in 1..=9_u32 {
        let stop = Stop::Residual { tolerance: 1e-12, max_iterations: cap };
        let (report, x) = system.solve::<f64>(PreconditionerKind::Identity, stop);
        assert_eq!((report.outcome, report.iterations), (Outcome::IterationCap, cap));
        let best = norms[..=cap as usize].iter().copied().fold(f64::INFINITY, f64::min) / norms[0];
        let found = system.residual(&x);
        assert!((found / best - 1.0).abs() < 1e-3, "after {cap}: residual {found}, not {best}");
    }
}

#[test]
fn a_fixed_number_of_iterations_is_made_whatever_the_residual() {
    let system = System::named("spd_tetra_stretched");
    for count in 1..=10 {
        let (report, _) = system.solve::<f64>(PreconditionerKind::Identity, Stop::Iterations(count));
        assert_eq!((report.outcome, report.iterations), (Outcome::IterationCap, count));
    }
}

//! Laws one matrix at a time: golden answers, stress and tangent as derivatives, no frame that is
//! special, uniaxial strain, hardening, and what is pushed into J_P.

use nappe_sim::{
    math::Mat3,
    snow::{
        Law, Material, Plasticity,
        constitutive_scalar::{
            Return, energy_density, kirchhoff, piola, piola_derivative, return_map, signed_svd,
        },
    },
};
use nappe_tests::{
    Random, golden,
    snow::{elastic, with_law},
};
use serde::Deserialize;

use crate::reference::{free_snow, matrix, relative};

type Rows = [[f64; 3]; 3];

#[derive(Deserialize)]
#[allow(non_snake_case, reason = "the names of the table")]
struct Sample {
    id: usize,
    category: String,
    FE_trial: Rows,
    FP_n: Rows,
    JP_n: f64,
    JE: f64,
    sigma_signed: [f64; 3],
    R: Rows,
    psi: f64,
    P: Rows,
    kirchhoff: Rows,
    cauchy: Rows,
    FE_new: Rows,
    FP_new: Rows,
    JP_new: f64,
    plastic: bool,
}

#[derive(Deserialize)]
struct Samples<T> {
    samples: Vec<T>,
}

fn samples() -> Vec<Sample> {
    let document: Samples<Sample> = golden::document("mpm/snow_constitutive.json");
    assert_eq!(document.samples.len(), 200);
    document.samples
}

/// Stress (Pa) that rounding is relative to: 2 mu, at J_P of the sample.
fn stress_scale(jp: f64) -> f64 {
    2.0 * free_snow().mu() * (10.0 * (1.0 - jp)).exp()
}

#[test]
fn golden_singular_values_and_rotations() {
    for s in samples() {
        let f = matrix(&s.FE_trial);
        let (u, sigma, v) = signed_svd(&f);
        let what = format!("sample {} ({})", s.id, s.category);

        for (own, golden) in sigma.iter().zip(s.sigma_signed) {
            let off = (own - golden).abs() / s.sigma_signed[0];
            assert!(off < 1e-14, "{what}: singular values {sigma:?}, not {:?}", s.sigma_signed);
        }
        let back = u * Mat3::from_diagonal(&sigma.into()) * v.transpose();
        assert!(relative(&back, &f, 0.0) < 1e-14, "{what}: U sigma V^T is not F");

        for (name, m) in [("U", u), ("V", v)] {
            assert!((m.determinant() - 1.0).abs() < 1e-13, "{what}: {name} is no rotation");
            assert!((m.transpose() * m - Mat3::identity()).norm() < 1e-13, "{what}: {name}");
        }
        let own = return_map(&free_snow(), &f, s.JP_n);
        let off = relative(&own.rotation, &matrix(&s.R), 0.0);
        assert!(off < 1e-11, "{what}: R is off by {off:e}");
        assert_eq!(own.singular_values, sigma, "{what}");
    }
}

#[test]
fn golden_energies_and_stresses() {
    let snow = free_snow();
    for s in samples() {
        let (f, what) = (matrix(&s.FE_trial), format!("sample {} ({})", s.id, s.category));
        let scale = stress_scale(s.JP_n);
        let tau = kirchhoff(&snow, &f, s.JP_n);
        let pairs = [
            ("P", piola(&snow, &f, s.JP_n), matrix(&s.P), scale),
            ("tau", tau, matrix(&s.kirchhoff), scale * s.sigma_signed[0]),
            ("tau = P F^T", piola(&snow, &f, s.JP_n) * f.transpose(), matrix(&s.kirchhoff), scale),
        ];

        for (name, own, golden, scale) in pairs {
            let off = relative(&own, &golden, scale);
            assert!(off < 1e-11, "{what}: {name} is off by {off:e}");
        }
        // The table divides by J, which a singular F has none of: the same relative error.
        let cauchy = tau / (s.JE * s.JP_n);
        let off = relative(&cauchy, &matrix(&s.cauchy), scale / (s.JE * s.JP_n).abs());
        assert!(off < 1e-11, "{what}: sigma is off by {off:e}");
        let own = energy_density(&snow, &f, s.JP_n);
        let off = (own - s.psi).abs() / s.psi.max(scale * 1e-3);
        assert!(off < 1e-11, "{what}: psi = {own}, not {}", s.psi);
    }
}

#[test]
fn golden_return_mapping() {
    let snow = free_snow();
    let mut plastic = 0;
    for s in samples() {
        let (f, what) = (matrix(&s.FE_trial), format!("sample {} ({})", s.id, s.category));
        let own = return_map(&snow, &f, s.JP_n);
        let off = relative(&own.elastic, &matrix(&s.FE_new), 0.0);
        assert!(off < 1e-11, "{what}: F_E is off by {off:e}");
        let off = (own.plastic_ratio - s.JP_new).abs() / s.JP_new.abs().max(1.0);
        assert!(off < 1e-11, "{what}: J_P = {}, not {}", own.plastic_ratio, s.JP_new);
        let fp = own.elastic.try_inverse().expect("F_E is within the yield limits") * f * matrix(&s.FP_n);
        let off = relative(&fp, &matrix(&s.FP_new), 0.0);
        assert!(off < 1e-11, "{what}: F_P is off by {off:e}");

        // At the limits themselves rounding decides.
        let at_limit = s.sigma_signed.iter().any(|x| [0.975, 1.0075].iter().any(|y| (x - y).abs() < 1e-12));
        assert!(at_limit || own.yielded == s.plastic, "{what}: yielded is {}", own.yielded);
        assert_eq!(own.inverted, s.JE < 0.0 || s.JP_new <= 0.0, "{what}");
        assert!(!own.clamped, "{what}");
        plastic += usize::from(own.yielded);
    }

    assert!(plastic > 100, "{plastic} samples yield");
}

#[derive(Deserialize)]
#[allow(non_snake_case, reason = "the names of the table")]
struct Change {
    F: Rows,
    dF: Rows,
    dP: Rows,
    dF_colon_dP: f64,
    tangent_eig_min: f64,
    tangent_eig_max: f64,
    tangent_negative_eigenvalues: usize,
    category: String,
}

#[test]
fn golden_tangents_along_a_change() {
    let document: Samples<Change> = golden::document("mpm/snow_dPdF.json");
    assert_eq!(document.samples.len(), 50);
    for s in document.samples {
        let (f, change) = (matrix(&s.F), matrix(&s.dF));
        let own = piola_derivative(&free_snow(), &f, 1.0, &change);
        let off = relative(&own, &matrix(&s.dP), 0.0);
        assert!(off < 1e-10, "{}: dP is off by {off:e}", s.category);
        let work = own.dot(&change);
        let off = (work - s.dF_colon_dP).abs() / (own.norm() * change.norm());
        assert!(off < 1e-10, "{}: dF : dP is off by {off:e}", s.category);
    }
}

/// Eigenvalues of the tangent, by Jacobi rotations of the 9 x 9 matrix.
fn eigenvalues(material: &Material, f: &Mat3<f64>) -> Vec<f64> {
    let unit = |k: usize| Mat3::from_fn(|i, j| f64::from(u8::from(3 * i + j == k)));
    let columns: Vec<Mat3<f64>> = (0..9).map(|k| piola_derivative(material, f, 1.0, &unit(k))).collect();
    let mut a: Vec<Vec<f64>> = (0..9).map(|i| (0..9).map(|j| columns[j][(i / 3, i % 3)]).collect()).collect();

    for i in 0..9 {
        for j in 0..i {
            let scale = (0..9).map(|k| a[k][k].abs()).fold(0.0, f64::max);
            assert!((a[i][j] - a[j][i]).abs() < 1e-9 * scale, "the tangent is symmetric");
        }
    }

    for _ in 0..30 {
        for p in 0..9 {
            for q in p + 1..9 {
                let angle = 0.5 * (2.0 * a[p][q]).atan2(a[q][q] - a[p][p]);
                let (s, c) = angle.sin_cos();
                for row in &mut a {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }

                for k in 0..9 {
                    (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                }
            }
        }
    }

    (0..9).map(|k| a[k][k]).collect()
}

#[test]
fn golden_tangents_are_indefinite_where_the_table_says() {
    let document: Samples<Change> = golden::document("mpm/snow_dPdF.json");
    let mut indefinite = 0;
    for s in document.samples {
        let found = eigenvalues(&free_snow(), &matrix(&s.F));
        let (low, high) = found
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), e| (low.min(*e), high.max(*e)));
        for (own, golden) in [(low, s.tangent_eig_min), (high, s.tangent_eig_max)] {
            let off = (own - golden).abs() / s.tangent_eig_max.abs().max(s.tangent_eig_min.abs());
            assert!(off < 1e-9, "{}: eigenvalue {own}, not {golden}", s.category);
        }
        let negative = found.iter().filter(|e| **e < -1e-6 * high).count();
        assert_eq!(negative, s.tangent_negative_eigenvalues, "{}", s.category);
        indefinite += usize::from(negative > 0);
    }
    assert_eq!(indefinite, 41, "of 50 tangents");
}

/// Materials of every law.
fn materials() -> Vec<Material> {
    Law::ALL.into_iter().map(|law| with_law(elastic(1.4e5, 0.2), law)).collect()
}

#[test]
fn stress_is_the_derivative_of_energy_and_the_tangent_that_of_stress() {
    let mut random = Random::seeded(7);
    for material in materials() {
        for _ in 0..1000 {
            // J from 0.3 to 2, rotated.
            let f = random.deformation(0.3_f64.cbrt(), 2.0_f64.cbrt());
            let jp = random.between(0.8, 1.2);
            let p = piola(&material, &f, jp);
            let change = random.matrix();
            let scale = 2.0 * material.mu() * change.norm();

            let step = 1e-5;
            let energy = |t: f64| energy_density(&material, &(f + change * t), jp);
            let found = (energy(step) - energy(-step)) / (2.0 * step);
            let off = (found - p.dot(&change)).abs() / scale;
            assert!(off < 1e-7, "{}: P off by {off:e} at {f}", material.law.name());

            let stress = |t: f64| piola(&material, &(f + change * t), jp);
            let found = (stress(step) - stress(-step)) / (2.0 * step);
            let own = piola_derivative(&material, &f, jp, &change);
            let off = relative(&own, &found, scale);
            assert!(off < 1e-6, "{}: dP off by {off:e} at {f}", material.law.name());
        }
    }
}

#[test]
fn singular_and_inverted_deformations_have_finite_answers() {
    let mut random = Random::seeded(17);
    for material in materials().into_iter().chain([free_snow()]) {
        for stretches in [[1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3], [1.0, 0.5, -0.2], [1e-30, 1e-200, 0.0]]
        {
            let f = random.rotation() * Mat3::from_diagonal(&stretches.into()) * random.rotation();
            let change = piola_derivative(&material, &f, 1.0, &random.matrix());
            let Return { elastic, plastic_ratio, rotation, kirchhoff: tau, energy, .. } =
                return_map(&material, &f, 1.0);
            for m in
                [piola(&material, &f, 1.0), kirchhoff(&material, &f, 1.0), change, elastic, rotation, tau]
            {
                assert!(m.iter().all(|x| x.is_finite()), "{stretches:?}: {m}");
            }
            assert!(plastic_ratio.is_finite() && energy.is_finite(), "{stretches:?}");
            assert!((rotation.determinant() - 1.0).abs() < 1e-12, "{stretches:?}: R is no rotation");
        }
    }
}

#[test]
fn no_frame_and_no_direction_is_special() {
    let mut random = Random::seeded(3);
    for material in materials() {
        for _ in 0..200 {
            let f = random.deformation(0.5, 1.6);
            let q = random.rotation();
            let tau = kirchhoff(&material, &f, 1.0);
            let scale = 2.0 * material.mu();
            let turned = kirchhoff(&material, &(q * f), 1.0);
            let off = (turned - q * tau * q.transpose()).norm() / scale;
            assert!(off < 1e-12, "{}: tau(Q F) off by {off:e}", material.law.name());
            let other = kirchhoff(&material, &(f * q), 1.0);
            let off = (other - tau).norm() / scale;
            assert!(off < 1e-12, "{}: tau(F Q) off by {off:e}", material.law.name());
            let off = (tau - tau.transpose()).norm() / tau.norm();
            assert!(off < 1e-14, "{}: tau is off its transpose by {off:e}", material.law.name());
            let rigid = kirchhoff(&material, &q, 1.0).norm() / scale;
            assert!(rigid < 1e-14, "{}: a rotation has a stress of {rigid:e}", material.law.name());
        }
    }
}

#[test]
fn uniaxial_strain_has_the_closed_form() {
    let material = elastic(1.4e5, 0.2);
    let (lambda, mu) = (material.lambda(), material.mu());
    for e in [-0.9, -0.3, -0.01, 1e-6, 0.02, 0.5, 2.0] {
        let f = Mat3::from_diagonal(&[1.0 + e, 1.0, 1.0].into());
        // J = 1 + e, and R = I while e > -1.
        let across = lambda * e;
        let golden = Mat3::from_diagonal(&[(lambda + 2.0 * mu) * e, across, across].into());
        let own = kirchhoff(&material, &f, 1.0) / (1.0 + e);
        let off = (own - golden).norm() / (mu * e.abs());
        assert!(off < 1e-9, "e = {e}: sigma is off by {off:e}");
        let p = piola(&material, &f, 1.0)[(0, 0)];
        assert!((p - (lambda + 2.0 * mu) * e).abs() < 1e-9 * mu * e.abs(), "e = {e}: P_11 = {p}");
    }
}

#[test]
fn hardening_follows_its_exponential_and_only_grows_under_compaction() {
    let snow = free_snow();
    let f = Mat3::new(1.003, 0.002, -0.001, 0.0, 0.99, 0.004, 0.001, 0.0, 1.001);
    let soft = piola(&snow, &f, 1.0);
    let mut last = f64::INFINITY;
    for jp in (10..=200).map(|i| 0.05 * f64::from(i) - 0.4) {
        let factor = (10.0 * (1.0 - jp)).exp();
        let off = relative(&piola(&snow, &f, jp), &(soft * factor), 0.0);
        assert!(off < 1e-13, "J_P = {jp}: P is off by {off:e}");
        let energy = energy_density(&snow, &f, jp);
        let off = (energy / energy_density(&snow, &f, 1.0) / factor - 1.0).abs();
        assert!(off < 1e-13, "J_P = {jp}: energy is off by {off:e}");
        assert!(energy < last, "J_P = {jp}: softer snow holds more energy");
        last = energy;
    }
}

#[test]
fn what_the_elastic_part_loses_the_plastic_part_gains() {
    let snow = free_snow();
    let mut random = Random::seeded(29);
    let mut yielded = 0;

    for _ in 0..1000 {
        let (f, fp) = (random.deformation(0.9, 1.1), random.deformation(0.8, 1.2));
        let jp = fp.determinant();
        let own = return_map(&snow, &f, jp);

        // F_E F_P = F before and after, so their determinants too.
        let off = (own.elastic.determinant() * own.plastic_ratio / (f.determinant() * jp) - 1.0).abs();
        assert!(off < 1e-13, "det F_E J_P changes by {off:e}");
        let (_, sigma, _) = signed_svd(&own.elastic);
        assert!(sigma.iter().all(|s| (0.975 - 1e-13..=1.0075 + 1e-13).contains(s)), "{sigma:?}");
        let again = return_map(&snow, &own.elastic, own.plastic_ratio);
        assert!((again.plastic_ratio / own.plastic_ratio - 1.0).abs() < 1e-13, "a return is idempotent");

        // F_E keeps the directions of the predictor: F_E^-1 F is symmetric in the frame of V.
        let push = own.elastic.try_inverse().expect("it is near a rotation") * f;
        assert!((push - push.transpose()).norm() < 1e-12, "what is pushed into F_P is a pure stretch");
        yielded += usize::from(own.yielded);
    }

    assert!(yielded > 800, "{yielded} of 1000 yield");
}

#[test]
fn plastic_ratios_are_held_in_their_range() {
    let mut snow = free_snow();
    let plasticity = snow.plasticity.expect("snow yields");
    snow.plasticity = Some(Plasticity { plastic_ratio_range: [0.6, 20.0], ..plasticity });
    let squeezed = return_map(&snow, &(Mat3::identity() * 0.5), 1.0);
    assert!(squeezed.clamped && squeezed.plastic_ratio == 0.6, "{squeezed:?}");
    let torn = return_map(&snow, &(Mat3::identity() * 4.0), 1.0);
    assert!(torn.clamped && torn.plastic_ratio == 20.0, "{torn:?}");
    let within = return_map(&snow, &(Mat3::identity() * 0.95), 1.0);
    assert!(!within.clamped && within.yielded, "{within:?}");
}

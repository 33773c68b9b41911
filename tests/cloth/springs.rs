//! One spring: its force and derivatives against samples computed in 60 digits, its force as the
//! gradient of the energy, and the assembled forces of a network.

use nappe_sim::{
    cloth::{Hessian, Integrator, Network, spring_force, spring_jacobian_v, spring_jacobian_x},
    math::{Mat3, Precision, Real, Vec3, vec3},
};
use nappe_tests::{
    Method, Scene,
    golden::document,
    networks::{scatter, sheet, sheet_rules},
    scene::{advance, difference, max_distance, norm, positions, velocities},
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Samples {
    samples: Vec<Sample>,
}

#[derive(Deserialize)]
struct Sample {
    xi: [f64; 3],
    xj: [f64; 3],
    vi: [f64; 3],
    vj: [f64; 3],
    k: f64,
    nu: f64,
    l0: f64,
    f_i: [f64; 3],
    dfi_dxi_elastic: [[f64; 3]; 3],
    dfi_dvi: [[f64; 3]; 3],
}

impl Sample {
    fn all() -> Vec<Self> {
        document::<Samples>("spring_mass/spring_force_samples.json").samples
    }

    fn d<R: Real>(&self) -> Vec3<R> {
        vec3(difference(self.xi, self.xj))
    }

    fn force<R: Real>(&self) -> Vec3<R> {
        let dv = vec3(difference(self.vi, self.vj));
        spring_force(&self.d(), &dv, R::of(self.l0), R::of(self.k), R::of(self.nu))
    }
}

fn matrix(rows: &[[f64; 3]; 3]) -> Mat3<f64> {
    Mat3::from_fn(|i, j| rows[i][j])
}

/// Largest component of the difference over the largest component of `reference`.
fn relative(found: &Mat3<f64>, reference: &Mat3<f64>) -> f64 {
    (found - reference).amax() / reference.amax()
}

#[test]
fn a_spring_pulls_with_the_force_of_the_samples() {
    for (i, sample) in Sample::all().iter().enumerate() {
        let reference: Vec3<f64> = vec3(sample.f_i);
        let error = (sample.force::<f64>() - reference).norm() / reference.norm();
        assert!(error < 1e-12, "sample {i}: {error:e}");

        // Rounding of the inputs moves the force by k l and nu |dv| times a few roundings.
        let scale = sample.k * sample.d::<f64>().norm()
            + sample.nu * norm(difference(sample.vi, sample.vj))
            + sample.k * sample.l0;
        let single = sample.force::<f32>().map(f64::from);
        let error = (single - reference).norm() / scale;
        assert!(error < 8.0 * f32::ROUNDING, "sample {i} in f32: {error:e}");
    }
}

#[test]
fn a_spring_has_the_derivatives_of_the_samples() {
    for (i, sample) in Sample::all().iter().enumerate() {
        let d = sample.d::<f64>();
        let elastic = relative(
            &spring_jacobian_x(&d, sample.l0, sample.k, Hessian::Full),
            &matrix(&sample.dfi_dxi_elastic),
        );
        let damping = relative(&spring_jacobian_v(&d, sample.nu), &matrix(&sample.dfi_dvi));
        assert!(elastic < 1e-12 && damping < 1e-12, "sample {i}: {elastic:e}, {damping:e}");
    }
}

#[test]
fn the_derivative_that_is_worked_by_hand_has_the_force_in_rows_and_the_place_in_columns() {
    // u = (0.6, 0.8, 0) and g = 1 - 4 / 5.
    let d = Vec3::new(3.0, 4.0, 0.0);
    let found = spring_jacobian_x(&d, 4.0, 10.0, Hessian::Full);
    let by_hand = matrix(&[[-4.88, -3.84, 0.0], [-3.84, -7.12, 0.0], [0.0, 0.0, -2.0]]);
    assert!(relative(&found, &by_hand) < 1e-14, "{found}");
    let force = |d: Vec3<f64>| spring_force(&d, &Vec3::zeros(), 4.0, 10.0, 0.0);
    for c in 0..3 {
        let mut step = Vec3::zeros();
        step[c] = 1e-6;
        let slope = (force(d + step) - force(d - step)) / 2e-6;
        assert!((slope - by_hand.column(c)).amax() < 1e-8, "column {c}: {slope}");
    }
}

#[test]
fn the_treatments_of_compression_change_only_the_transverse_stiffness() {
    for (i, sample) in Sample::all().iter().enumerate() {
        let d = sample.d::<f64>();
        let transverse = 1.0 - sample.l0 / d.norm();
        for (hessian, share) in [
            (Hessian::Full, transverse),
            (Hessian::Clamped, transverse.max(0.0)),
            (Hessian::Absolute, transverse.abs()),
        ] {
            let u = d / d.norm();
            let along = u * u.transpose();
            let expected = (along + (Mat3::identity() - along) * share) * -sample.k;
            let found = spring_jacobian_x(&d, sample.l0, sample.k, hessian);
            let error = relative(&found, &expected);
            assert!(error < 1e-14 * 10.0, "sample {i}, {hessian:?}: {error:e}");
            assert_eq!(found, found.transpose(), "sample {i}, {hessian:?}: symmetric to the last bit");
        }
    }
}

#[test]
fn the_stiffness_of_a_spring_is_the_derivative_of_its_force() {
    for (i, sample) in Sample::all().iter().enumerate() {
        let d = sample.d::<f64>();
        let force = |d: Vec3<f64>| spring_force(&d, &Vec3::zeros(), sample.l0, sample.k, sample.nu);
        let step = 1e-5 * d.norm();
        let mut numeric = Mat3::zeros();
        for c in 0..3 {
            let mut shift = Vec3::zeros();
            shift[c] = step;
            numeric.set_column(c, &((force(d + shift) - force(d - shift)) / (2.0 * step)));
        }

        let error = relative(&numeric, &spring_jacobian_x(&d, sample.l0, sample.k, Hessian::Full));
        assert!(error < 1e-7, "sample {i}: {error:e}");
    }
}

/// A pinned sheet, everywhere a little out of place: springs stretched and compressed.
fn shaken(side: usize, amplitude: f64) -> Network {
    let mut network = sheet(side, 0.1, &sheet_rules(300.0, 0.0), 0.01);
    for (i, x) in network.x.iter_mut().enumerate() {
        for (c, x) in x.iter_mut().enumerate() {
            *x += amplitude * scatter(3 * i + c);
        }
    }
    network
}

/// Force on each particle (N), seen through one explicit step from rest.
fn forces(network: &Network) -> Vec<[f64; 3]> {
    let mut scene = Scene::new(network.clone(), 1.0);
    scene.settings.integrator = Integrator::ExplicitEuler;
    let mut simulation = scene.simulate(Precision::F64);
    advance(&mut simulation, 1);
    let v = velocities(&simulation);
    (0..v.len()).map(|i| v[i].map(|v| v * network.masses[i])).collect()
}

#[test]
fn the_force_of_a_network_is_minus_the_gradient_of_its_energy() {
    for amplitude in [1e-6, 0.01, 0.04] {
        let network = shaken(6, amplitude);
        let found = forces(&network);
        let energy = |particle: usize, c: usize, shift: f64| {
            let mut moved = network.clone();
            moved.x[particle][c] += shift;
            Scene::new(moved, 1.0).simulate(Precision::F64).diagnose().elastic_energy
        };

        // Central differences err by a sixth of h² d³E/dx³, and d³E/dx³ is some k / l;
        // the shortest spring is 4 cm long.
        let (h, stiffness, length) = (1e-5, 300.0, 0.04);
        let tolerance = h * h * stiffness / length;
        for particle in (1..36).filter(|p| *p != 5) {
            for c in 0..3 {
                let slope = (energy(particle, c, h) - energy(particle, c, -h)) / (2.0 * h);
                let error = (found[particle][c] + slope).abs();
                assert!(error < tolerance, "{amplitude}: particle {particle}, component {c}: {error:e} N");
            }
        }
    }
}

/// A rotation about (1, 2, 3) and a shift.
fn moved(x: [f64; 3]) -> [f64; 3] {
    let shift = [3.0, -2.0, 0.5];
    let turned = turned(x);
    [0, 1, 2].map(|c| turned[c] + shift[c])
}

fn turned(x: [f64; 3]) -> [f64; 3] {
    let axis = nalgebra_unit();
    let (sin, cos) = 1.1_f64.sin_cos();
    let x = Vec3::from(x);
    let along = axis * axis.dot(&x);
    (along + (x - along) * cos + axis.cross(&x) * sin).into()
}

fn nalgebra_unit() -> Vec3<f64> {
    Vec3::new(1.0, 2.0, 3.0).normalize()
}

#[test]
fn a_moved_and_turned_scene_moves_as_the_scene_does() {
    let gravity = [0.0, -9.81, 0.0];
    for method in Method::all() {
        let network = shaken(8, 0.01);
        let mut other = network.clone();
        other.x.iter_mut().for_each(|x| *x = moved(*x));
        let run = |network: Network, gravity| {
            let scene = Scene::new(network, 1e-3).by(method).under(gravity);
            let mut simulation = scene.simulate(Precision::F64);
            advance(&mut simulation, 20);
            positions(&simulation)
        };

        let expected: Vec<_> = run(network, gravity).into_iter().map(moved).collect();
        let distance = max_distance(&run(other, turned(gravity)), &expected);

        // Coordinates of a few metres, a step's rounding grown over 20 steps.
        assert!(distance < 1e-12, "{}: {distance:e}", method.name());
    }
}

//! Snow that turns from the start: the first step leaves it the spin that the scene gives it.

use nappe_sim::{
    math::Precision,
    snow::{ParticleState, SnowObject},
};
use nappe_tests::{
    scene::{advance, cross, difference, norm},
    snow::{
        SnowScene, Variant, angular_momentum, ball, center, elastic, kinetic_energy, object, second_moment,
        step_once,
    },
};

const H: f64 = 0.1;
/// Along no axis, 5 rad/s.
const SPIN: [f64; 3] = [3.0, -2.4, 3.2];
const MIDDLE: [f64; 3] = [0.37, -0.21, 0.64];

/// A ball of some cells per radius that turns about its own middle.
fn turning(cells: f64) -> SnowObject {
    let x = ball(MIDDLE, cells * H, 0.5 * H);
    let mut body = object("ball", x, (0.5 * H).powi(3), 400.0, elastic(1.4e5, 0.2));
    body.v = body.x.iter().map(|x| cross(SPIN, difference(*x, MIDDLE))).collect();
    body.angular_velocity = SPIN;
    body
}

/// Angular velocity (rad/s) about the middle that has the angular momentum of the velocities, along the spin.
fn spin(particles: &[ParticleState], masses: &[f64], before: &[[f64; 3]]) -> f64 {
    let way = SPIN.map(|c| c / norm(SPIN));
    let (mut momentum, mut inertia) = (0.0, 0.0);
    for ((p, m), x) in particles.iter().zip(masses).zip(before) {
        let r = difference(*x, MIDDLE);
        let l = cross(r, p.v);
        momentum += m * (0..3).map(|c| way[c] * l[c]).sum::<f64>();
        inertia += m * norm(cross(way, r)).powi(2);
    }
    momentum / inertia
}

#[test]
fn the_first_step_leaves_a_spin_as_it_was_given() {
    for variant in Variant::affine() {
        // A transfer gives an affine field back as it came, up to rounding; at rest there is no force.
        for (precision, tolerance) in [(Precision::F64, 1e-12), (Precision::F32, 2e-5)] {
            for cells in [2.0, 4.0] {
                let scene = SnowScene::new(vec![turning(cells)], H, 1e-3).by(variant);
                let (mut simulation, masses) = (scene.simulate(precision), scene.masses());
                let moment = second_moment(variant.kernel, H);
                let start = simulation.snow_particles();
                let before: Vec<[f64; 3]> = start.iter().map(|p| p.x).collect();
                step_once(&mut simulation);
                let end = simulation.snow_particles();

                let what = format!("{} in {precision}, {cells} cells per radius", variant.name());
                let found = spin(&end, &masses, &before);
                assert!((found / norm(SPIN) - 1.0).abs() < tolerance, "{what}: {found} rad/s");
                for moment in [0.0, moment] {
                    let [old, new] = [&start, &end].map(|p| kinetic_energy(p, &masses, moment));
                    assert!((new / old - 1.0).abs() < tolerance, "{what}: {old} J becomes {new} J");
                }

                // No affine velocity is lost either: it holds angular momentum of its own.
                let [old, new] = [&start, &end].map(|p| angular_momentum(p, &masses, moment));
                let change = norm(difference(new, old)) / norm(old);
                assert!(change < tolerance, "{what}: the angular momentum changes by {change:e}");
                for p in &end {
                    for d in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
                        let c = p.affine.map(|row| row[0] * d[0] + row[1] * d[1] + row[2] * d[2]);
                        let off = norm(difference(c, cross(SPIN, d))) / norm(SPIN);
                        assert!(off < 10.0 * tolerance, "{what}: C d is {c:?}, off by {off:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_ball_that_turns_from_the_start_keeps_its_angular_momentum_and_stays_where_it_is() {
    for variant in Variant::affine() {
        let scene = SnowScene::new(vec![turning(2.0)], H, 1e-3).by(variant);
        let (mut simulation, masses) = (scene.simulate(Precision::F64), scene.masses());
        let moment = second_moment(variant.kernel, H);
        let total = |p: &[ParticleState]| angular_momentum(p, &masses, moment);
        let start = total(&simulation.snow_particles());
        advance(&mut simulation, 200);
        let end = simulation.snow_particles();
        let change = norm(difference(total(&end), start)) / norm(start);
        assert!(change < 1e-12, "{}: {change:e}", variant.name());
        let moved = norm(difference(center(&end, &masses, |_| true), MIDDLE));
        assert!(moved < 1e-12, "{}: its middle moves by {moved:e} m", variant.name());
    }
}

#[test]
fn an_angular_velocity_that_is_not_finite_is_refused() {
    let mut body = turning(2.0);
    body.angular_velocity[1] = f64::NAN;
    let setup = SnowScene::new(vec![body], H, 1e-3).setup();
    let error = nappe_sim::world::Simulation::new(&setup, Precision::F64).map(|_| ()).expect_err("no number");
    let wanted = "snow 'ball': its angular velocity is [3.0, NaN, 3.2]: finite numbers are needed";
    assert_eq!(error.to_string(), wanted);
}

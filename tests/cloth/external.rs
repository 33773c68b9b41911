//! Gravity, drag and wind on particles without springs.

use nappe_sim::{math::Precision, world::Change};
use nappe_tests::{
    Method, ScalarLaw, Scene,
    networks::particles,
    scene::{advance, difference, norm, positions, velocities},
};

const MASS: f64 = 0.2;
const DRAG: f64 = 0.5;
const GRAVITY: f64 = 9.81;

/// Three particles that fall through a medium.
fn falling(method: Method, dt: f64) -> Scene {
    let mut network = particles(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 5.0, 2.0]], MASS);
    network.drag = DRAG;
    Scene::new(network, dt).by(method).under([0.0, -GRAVITY, 0.0])
}

#[test]
fn a_fall_through_a_medium_follows_the_definition_of_each_integrator() {
    let law = ScalarLaw { stiffness: 0.0, damping: DRAG / MASS, force: -GRAVITY };
    for method in Method::all() {
        let dt = 0.02;
        let mut simulation = falling(method, dt).simulate(Precision::F64);
        advance(&mut simulation, 100);
        let expected = law.run(method.integrator, dt, [0.0, 0.0], 100);

        for (i, height) in [0.0, 0.0, 5.0].into_iter().enumerate() {
            let found = [positions(&simulation)[i][1] - height, velocities(&simulation)[i][1]];
            let error = (found[0] - expected[0]).hypot(found[1] - expected[1]);
            assert!(error < 1e-12 * 8.0, "{}, particle {i}: {error:e}", method.name());
        }
    }
}

#[test]
fn a_fall_through_a_medium_has_the_speed_of_the_closed_form() {
    let (dt, time) = (1e-4, 0.3);
    let rate = DRAG / MASS;
    let expected = -GRAVITY / rate * (1.0 - (-rate * time).exp());
    for method in Method::all() {
        let mut simulation = falling(method, dt).simulate(Precision::F64);
        advance(&mut simulation, 3000);
        let error = (velocities(&simulation)[0][1] - expected).abs();

        // An integrator of order 1 errs by half of dt times the change of acceleration.
        let first = 0.5 * dt * rate * GRAVITY * rate * time;
        let tolerance = if method.order(DRAG) > 1.0 { 1e-6 } else { first };
        assert!(error < tolerance, "{}: {error:e} m/s of {tolerance:e}", method.name());
    }
}

#[test]
fn a_particle_ends_at_the_wind_and_its_terminal_velocity() {
    let wind = [3.0, 0.5, -1.0];
    let terminal = [wind[0], wind[1] - MASS * GRAVITY / DRAG, wind[2]];
    for method in Method::all() {
        let mut scene = falling(method, 0.02);
        scene.wind = wind;
        let mut simulation = scene.simulate(Precision::F64);
        advance(&mut simulation, 1000);
        for v in velocities(&simulation) {
            let error = norm(difference(v, terminal));
            assert!(error < 1e-9, "{}: {error:e} m/s", method.name());
        }
    }
}

#[test]
fn changes_take_effect_at_the_next_step() {
    for method in Method::all() {
        let dt = 0.01;
        let mut simulation = falling(method, dt).simulate(Precision::F64);
        advance(&mut simulation, 10);
        let before = velocities(&simulation)[0];
        let gravity = [1.0, 2.0, 3.0];
        simulation.apply(&[Change::Gravity(gravity), Change::Drag(0.0)]).expect("two fair changes");
        advance(&mut simulation, 1);
        let gained = difference(velocities(&simulation)[0], before);
        let error = norm(difference(gained, gravity.map(|g| g * dt)));
        assert!(error < 1e-14, "{}: {error:e}", method.name());

        simulation.apply(&[Change::Wind([7.0, 0.0, 0.0]), Change::Drag(DRAG)]).expect("two fair changes");
        simulation.apply(&[Change::Gravity([0.0; 3])]).expect("a fair change");
        advance(&mut simulation, 3000);
        let error = norm(difference(velocities(&simulation)[0], [7.0, 0.0, 0.0]));
        assert!(error < 1e-9, "{}: {error:e} m/s from the wind", method.name());
    }
}

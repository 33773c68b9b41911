//! A step that fails names step, particle and value, and leaves the state as it was.

use nappe_sim::{
    cloth::{Integrator, Network, StateLimits},
    math::Precision,
    report::{NoStopwatch, StepError, StepFailure},
    world::Simulation,
};
use nappe_tests::{
    Method, Scene,
    networks::{chain, sheet, sheet_rules},
    scene::{positions, velocities},
};

/// Steps until one fails; the state before it must be kept, and the failure repeat itself.
fn until_failure(simulation: &mut Simulation, limit: u64) -> StepError {
    for step in 0..limit {
        let (hash, x, v) = (simulation.state_hash(), positions(simulation), velocities(simulation));
        let time = simulation.time();
        if let Err(error) = simulation.step(&mut NoStopwatch) {
            assert_eq!((error.step, error.time), (step, time), "{error}");
            assert_eq!(simulation.state_hash(), hash, "{error}");
            assert_eq!((positions(simulation), velocities(simulation)), (x, v), "{error}");
            assert_eq!((simulation.step_count(), simulation.time()), (step, time), "{error}");

            // As text: NaN does not equal itself.
            let again = simulation.step(&mut NoStopwatch).expect_err("the same step fails again");
            assert_eq!(again.to_string(), error.to_string());
            assert_eq!(simulation.state_hash(), hash, "{error}");
            return error;
        }
    }
    panic!("no step of {limit} failed");
}

fn wild_sheet() -> Network {
    sheet(12, 0.1, &sheet_rules(500.0, 0.0), 0.01)
}

#[test]
fn a_diverging_run_stops_and_names_step_particle_and_value() {
    for integrator in Integrator::ALL.into_iter().filter(|i| !i.is_implicit()) {
        for precision in Precision::ALL {
            let mut scene = Scene::new(wild_sheet(), 0.05).under([0.0, -9.81, 0.0]);
            scene.settings.integrator = integrator;
            let error = until_failure(&mut scene.simulate(precision), 2000);
            let StepFailure::NotFinite { particle, value, .. } = error.failure else {
                panic!("{integrator:?} in {precision}: {error}")
            };
            assert!(particle < 144 && !value.is_finite(), "{integrator:?} in {precision}: {error}");
            assert_eq!(error.failure.reason(), "NOT_FINITE");
            let text = error.to_string();
            assert!(text.contains(&format!("step {}", error.step)), "{text}");
            assert!(text.contains(&format!("particle {particle}")), "{text}");
            assert!(text.contains("'body'"), "{text}");
        }
    }
}

#[test]
fn the_particle_named_is_the_one_that_is_lost() {
    // Particle 17 alone is light enough to diverge.
    let x: Vec<_> = (0..40).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.1, 50.0, 0.0, 1e6);
    network.masses[17] = 1e-4;
    network.v[17] = [0.0, 1.0, 0.0];
    let mut scene = Scene::new(network, 0.05);
    scene.settings.integrator = Integrator::SymplecticEuler;
    scene.settings.limits = StateLimits { max_stretch: None, max_energy: Some(1e6) };
    let error = until_failure(&mut scene.simulate(Precision::F64), 2000);
    assert_eq!(error.failure.particle(), Some(17), "{error}");
}

#[test]
fn a_spring_stretched_beyond_the_limit_stops_the_run() {
    let x = [[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [0.3, 0.0, 0.0]];
    for method in Method::all() {
        for precision in Precision::ALL {
            let mut network = chain(&x, 0.1, 5.0, 0.0, 0.1);
            network.pins = vec![0];
            network.v[3] = [1.0, 0.0, 0.0];
            let mut scene = Scene::new(network, 1e-3).by(method);
            scene.settings.limits.max_stretch = Some(1.5);
            let error = until_failure(&mut scene.simulate(precision), 200);
            let StepFailure::Stretch { particle, other, value, limit, pin } = error.failure else {
                panic!("{} in {precision}: {error}", method.name())
            };
            let ends = [particle.min(other), particle.max(other)];
            assert_eq!((ends, pin), ([2, 3], None), "{} in {precision}: {error}", method.name());
            assert!(
                limit == 1.5 && value > limit && value < 1.52,
                "{} in {precision}: {error}",
                method.name()
            );
            // 0.5 rest lengths at less than 1 m/s.
            assert!((50..80).contains(&error.step), "{} in {precision}: {error}", method.name());
        }
    }
}

#[test]
fn energy_beyond_the_limit_stops_the_run() {
    for method in Method::all() {
        // 0.1 kg falls: m g² t² / 2 passes 1 J at t = 0.4559 s.
        let network = chain(&[[0.0; 3], [0.0, 1.0, 0.0]], 1.0, 5.0, 0.0, 0.05);
        let mut scene = Scene::new(network, 1e-3).by(method).under([0.0, -9.81, 0.0]);
        scene.settings.limits.max_energy = Some(1.0);
        let error = until_failure(&mut scene.simulate(Precision::F64), 1000);
        let StepFailure::Energy { particle, value, limit } = error.failure else {
            panic!("{}: {error}", method.name())
        };

        assert!(particle < 2 && value > limit && value < 1.01 && limit == 1.0, "{}: {error}", method.name());
        assert_eq!(error.step, 455, "{}: {error}", method.name());
    }
}

#[test]
fn limits_that_are_kept_change_nothing() {
    for method in Method::all() {
        let run = |limits: StateLimits| {
            let mut scene = Scene::new(wild_sheet(), 1e-4).by(method).under([0.0, -9.81, 0.0]);
            scene.settings.limits = limits;
            let mut simulation = scene.simulate(Precision::F64);
            nappe_tests::scene::advance(&mut simulation, 20);
            simulation.state_hash()
        };

        let limits = StateLimits { max_stretch: Some(3.0), max_energy: Some(1e3) };
        assert_eq!(run(limits), run(StateLimits::default()), "{}", method.name());
    }
}

#[test]
fn forces_that_overflow_stop_every_method() {
    // In binary32 the square of the spring's length is out of range though its length is not.
    for method in Method::all() {
        let mut network = chain(&[[0.0; 3], [0.1, 0.0, 0.0]], 0.1, 5.0, 0.01, 0.1);
        network.pins = vec![0];
        network.v[1] = [1e21, 0.0, 0.0];
        let scene = Scene::new(network, 1.0).by(method);
        let error = until_failure(&mut scene.simulate(Precision::F32), 20);
        let StepFailure::NotFinite { particle, .. } = error.failure else {
            panic!("{}: {error}", method.name())
        };

        assert_eq!(particle, 1, "{}: {error}", method.name());
    }
}

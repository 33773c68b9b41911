//! Pinned particles: still, or moving to where they are told.

use nappe_sim::{
    linalg::Stop,
    math::Precision,
    world::{Change, ChangeError},
};
use nappe_tests::{
    Method, Scene,
    networks::{chain, scatter, sheet, sheet_rules},
    scene::{advance, difference, max_distance, norm, positions, velocities},
};

fn hung_sheet(method: Method) -> Scene {
    let mut network = sheet(8, 0.1, &sheet_rules(200.0, 0.05), 0.01);
    network.drag = 0.01;
    // A pin by its mass, in the middle.
    network.masses[27] = 0.0;
    let mut scene = Scene::new(network, 1e-3).by(method).under([0.0, -9.81, 0.0]);
    scene.wind = [4.0, 0.0, 1.0];
    scene
}

#[test]
fn pinned_particles_never_move() {
    for method in Method::all() {
        for precision in Precision::ALL {
            let mut scene = hung_sheet(method);
            scene.settings.solver.stop = Stop::Residual { tolerance: 1e-5, max_iterations: 100 };
            let mut simulation = scene.simulate(precision);
            let before = positions(&simulation);
            advance(&mut simulation, 100);
            let after = positions(&simulation);
            for pin in [0, 7, 27] {
                assert_eq!(after[pin], before[pin], "{} in {precision}, pin {pin}", method.name());
                assert_eq!(velocities(&simulation)[pin], [0.0; 3], "{} in {precision}", method.name());
            }
            assert!(max_distance(&before, &after) > 1e-2, "{}: the others move", method.name());
        }
    }
}

#[test]
fn a_moving_pin_arrives_at_its_target_at_constant_speed() {
    let target = [0.3, 0.2, -0.1];
    for method in Method::all() {
        let mut simulation = hung_sheet(method).simulate(Precision::F64);
        let [start, other] = [0, 7].map(|pin: usize| positions(&simulation)[pin]);
        advance(&mut simulation, 10);
        simulation.apply(&[Change::Pin { particle: 0, target, duration: 0.1 }]).expect("a pin may move");
        for step in 1..=110_u32 {
            advance(&mut simulation, 1);
            let share = (f64::from(step) / 100.0).min(1.0);
            let expected = [0, 1, 2].map(|c| start[c] + share * (target[c] - start[c]));
            let error = norm(difference(positions(&simulation)[0], expected));
            assert!(error < 1e-14, "{}, step {step}: {error:e} m", method.name());
        }

        assert_eq!(positions(&simulation)[0], target, "{}: exactly there", method.name());
        assert_eq!(velocities(&simulation)[0], [0.0; 3], "{}: at rest", method.name());
        assert_eq!(positions(&simulation)[7], other, "{}: the other pin", method.name());
    }
}

#[test]
fn a_pin_that_has_no_time_moves_within_one_step() {
    for method in Method::all() {
        let mut simulation = hung_sheet(method).simulate(Precision::F64);
        let target = [0.001, 0.0, 0.0];
        simulation.apply(&[Change::Pin { particle: 0, target, duration: 0.0 }]).expect("a pin may move");
        advance(&mut simulation, 1);
        assert_eq!(positions(&simulation)[0], target, "{}", method.name());
    }
}

#[test]
fn a_moving_pin_arrives_at_its_target_to_the_last_bit() {
    // Numbers of binary32, so that both precisions can hold them.
    let targets: Vec<_> = (0..12).map(|i| [0, 1, 2].map(|c| f64::from(scatter(3 * i + c) as f32))).collect();
    for method in Method::all() {
        for precision in Precision::ALL {
            let mut scene = hung_sheet(method);
            scene.settings.solver.stop = Stop::Iterations(5);
            let mut simulation = scene.in_substeps(3).simulate(precision);
            for &target in &targets {
                simulation
                    .apply(&[Change::Pin { particle: 0, target, duration: 7e-3 }])
                    .expect("a pin may move");
                advance(&mut simulation, 7);
                assert_eq!(positions(&simulation)[0], target, "{} in {precision}", method.name());
            }
        }
    }
}

#[test]
fn a_chain_carried_by_its_pins_stays_at_rest_among_them() {
    let speed = [0.4, -0.2, 0.1];
    let x: Vec<_> = (0..6).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
    for method in Method::all() {
        let mut network = chain(&x, 0.1, 300.0, 0.0, 0.05);
        network.pins = vec![0, 5];
        network.v[1..5].fill(speed);
        let mut simulation = Scene::new(network, 1e-3).by(method).simulate(Precision::F64);
        let carry = |pin: usize| Change::Pin {
            particle: pin as u32,
            target: [0, 1, 2].map(|c| x[pin][c] + speed[c]),
            duration: 1.0,
        };

        simulation.apply(&[carry(0), carry(5)]).expect("pins may move");
        advance(&mut simulation, 500);
        let expected: Vec<_> = x.iter().map(|x| [0, 1, 2].map(|c| x[c] + 0.5 * speed[c])).collect();
        let error = max_distance(&positions(&simulation), &expected);
        assert!(error < 1e-12, "{}: {error:e} m", method.name());
    }
}

#[test]
fn only_pins_may_be_moved() {
    let mut simulation = hung_sheet(Method::all()[0]).simulate(Precision::F64);
    let hash = simulation.state_hash();
    let to = |particle| Change::Pin { particle, target: [0.0; 3], duration: 1.0 };
    assert_eq!(simulation.apply(&[to(0), to(3)]), Err(ChangeError::NotPinned { particle: 3 }));
    assert_eq!(
        simulation.rules().check(&[to(64)]),
        Err(ChangeError::NoSuchParticle { particle: 64, count: 64 })
    );

    // All or none: pin 0 was not moved either.
    advance(&mut simulation, 1);
    assert_eq!(positions(&simulation)[0], [0.0; 3]);
    assert_ne!(simulation.state_hash(), hash);
}

#[test]
fn work_for_pins_that_move_grows_with_their_number() {
    let side = 300;
    let mut network = sheet(side, 0.1, &sheet_rules(200.0, 0.05), 0.01);
    let count = network.x.len() as u32;
    network.pins = (0..count).collect();
    let mut simulation = Scene::new(network, 1e-3).simulate(Precision::F32);
    let start = positions(&simulation);

    // Each pin is sent twice, one by one: the second target holds.
    let begin = std::time::Instant::now();
    for height in [5.0, 1.0] {
        for particle in 0..count {
            let [x, y, z] = start[particle as usize];
            let change = Change::Pin { particle, target: [x, y + height, z], duration: 0.0 };
            simulation.apply(&[change]).expect("a pin may move");
        }
    }
    advance(&mut simulation, 1);
    let seconds = begin.elapsed().as_secs_f64();
    assert!(seconds < 60.0, "{seconds} s: searching all for each takes minutes");

    for (before, after) in start.iter().zip(positions(&simulation)) {
        assert!((after[1] - before[1] - 1.0).abs() < 1e-5, "{before:?} to {after:?}");
    }
}

#[test]
fn a_path_has_the_bits_of_its_moves_made_one_by_one() {
    let way = |step: u64| [0.0, 1e-3 * step as f64, 2e-3 * (0.7 * step as f64).sin()];
    for method in Method::all() {
        // Moves of one, two and three steps, one after the other.
        let arrivals: Vec<u64> = (0..60)
            .scan(0, |step, i| {
                *step += 1 + i % 3;
                Some(*step)
            })
            .collect();
        let last = *arrivals.last().expect("there are some");
        let points = arrivals.iter().map(|step| (1e-3 * *step as f64, way(*step))).collect();

        let mut along = hung_sheet(method).simulate(Precision::F32);
        along.apply(&[Change::PinPath { particle: 0, points }]).expect("a pin may follow a path");
        let mut one_by_one = hung_sheet(method).simulate(Precision::F32);
        let mut before = 0;
        for step in 0..last + 5 {
            if step == before
                && let Some(next) = arrivals.iter().find(|arrival| **arrival > step)
            {
                let duration = 1e-3 * (next - step) as f64;
                let change = Change::Pin { particle: 0, target: way(*next), duration };
                one_by_one.apply(&[change]).expect("a pin may move");
                before = *next;
            }
            advance(&mut along, 1);
            advance(&mut one_by_one, 1);
            // Their hashes differ: what is left of the path is a part of the state.
            let states = [&along, &one_by_one].map(|run| (positions(run), velocities(run)));
            assert_eq!(states[0], states[1], "{} step {step}", method.name());
        }
    }
}

#[test]
fn a_path_that_does_not_go_forward_in_time_is_refused() {
    let mut simulation = hung_sheet(Method::all()[0]).simulate(Precision::F64);
    let along = |times: &[f64]| {
        let points = times.iter().map(|time| (*time, [0.0; 3])).collect();
        simulation.rules().check(&[Change::PinPath { particle: 0, points }])
    };
    assert_eq!(along(&[0.1, 0.2]), Ok(()));
    assert_eq!(along(&[]), Err(ChangeError::EmptyPath { particle: 0 }));
    let refused = Err(ChangeError::TimesOfPath { particle: 0, point: 1, time: 0.1, after: 0.1 });
    assert_eq!(along(&[0.1, 0.1]), refused);
    assert!(matches!(along(&[0.0]), Err(ChangeError::TimesOfPath { point: 0, .. })));
    assert!(matches!(along(&[f64::NAN]), Err(ChangeError::OutOfRange { field: "times", .. })));
    let far: std::sync::Arc<[_]> = [(0.1, [0.0, 1e7, 0.0])].into();
    let refused = simulation.apply(&[Change::PinPath { particle: 0, points: far }]);
    assert!(matches!(refused, Err(ChangeError::OutOfRange { field: "targets", .. })));
}

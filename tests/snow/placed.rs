//! Given forces on snow, states from outside, and its start again.

use nappe_sim::{
    field::Field,
    math::Precision,
    snow::{SnowObject, SnowSettings, SnowSetup},
    world::{Change, ChangeError, Forces, Simulation, WorldSetup},
};
use nappe_tests::{
    scene::{advance, max_distance, positions, try_advance, velocities},
    snow::{Variant, ball, elastic},
};

const MASS: f64 = 0.001;

/// Two balls of snow in free space, the second one turning.
fn balls(variant: Variant) -> WorldSetup {
    let object = |name: &str, center: [f64; 3], angular_velocity: [f64; 3]| {
        let x = ball(center, 0.2, 0.05);
        let count = x.len();
        SnowObject {
            name: name.to_owned(),
            v: x.iter().map(|_| [0.1, 0.0, 0.0]).collect(),
            x,
            mass: vec![MASS; count],
            volume: vec![1.25e-4; count],
            angular_velocity,
            stiffness: Vec::new(),
            material: elastic(2e4, 0.3),
            attach: None,
        }
    };
    let objects =
        vec![object("still", [0.0; 3], [0.0; 3]), object("turning", [1.0, 0.0, 0.0], [0.0, 3.0, 0.0])];
    let settings =
        SnowSettings { kernel: variant.kernel, transfer: variant.transfer, ..SnowSettings::new(0.1) };
    WorldSetup {
        dt: 5e-3,
        gravity: [0.0; 3],
        wind: [0.0; 3],
        wind_at: Vec::new(),
        colliders: Vec::new(),
        bodies: Vec::new(),
        snow: Some(SnowSetup { objects, settings }),
    }
}

fn simulate(variant: Variant, precision: Precision) -> Simulation {
    Simulation::new(&balls(variant), precision).expect("two balls").0
}

fn force(body: &str, particles: &[u32], force: [f64; 3]) -> Change {
    Change::Force { body: body.to_owned(), particles: particles.into(), forces: Forces::One(force) }
}

#[test]
fn a_force_on_an_object_changes_its_momentum_by_itself_times_the_time_and_no_others() {
    for variant in Variant::affine() {
        let mut simulation = simulate(variant, Precision::F64);
        let count = simulation.topology()[0].particle_count as usize;
        let start = simulation.diagnose();
        simulation.apply(&[force("still", &[], [0.0, 2e-3, 0.0])]).expect("a fair force");
        let mut work = 0.0;
        let mut last = advance(&mut simulation, 1);
        work += last.diagnostics.external_work;
        for _ in 1..20 {
            last = advance(&mut simulation, 1);
            work += last.diagnostics.external_work;
        }
        let gained = last.diagnostics.momentum[1] - start.momentum[1];
        let expected = 2e-3 * count as f64 * 0.1;
        assert!((gained / expected - 1.0).abs() < 1e-9, "{}: {gained} N s, not {expected}", variant.name());
        // As a whole it is pushed like a rigid body, whose energy is the work.
        let energy = 0.5 * expected * expected / (count as f64 * MASS);
        assert!((work / energy - 1.0).abs() < 0.02, "{}: {work} J, not {energy}", variant.name());
        let rises = velocities(&simulation)[count..].iter().map(|v| v[1]).sum::<f64>() / count as f64;
        assert!(rises.abs() < 1e-12, "{}: {rises} m/s", variant.name());

        simulation.apply(&[force("still", &[], [0.0; 3])]).expect("a fair force");
        let before = last.diagnostics.momentum[1];
        let after = advance(&mut simulation, 5).diagnostics;
        assert!((after.momentum[1] - before).abs() < 1e-12 && after.external_work == 0.0);
    }
}

#[test]
fn an_object_goes_where_it_is_put_without_deformation_and_others_stay() {
    let variant = Variant::affine()[0];
    let mut simulation = simulate(variant, Precision::F64);
    let count = simulation.topology()[0].particle_count as usize;
    simulation.apply(&[force("still", &[0, 3, 9], [0.0, 1.0, 0.0])]).expect("a fair force");
    advance(&mut simulation, 30);
    let (x, v) = (positions(&simulation), velocities(&simulation));
    let put: Vec<[f64; 3]> = x[..count].iter().map(|[x, y, z]| [*x, y + 2.0, *z]).collect();
    let state = Change::State { body: "still".to_owned(), positions: put.clone().into(), velocities: None };
    simulation.apply(&[state]).expect("a fair state");
    let (now, speeds) = (positions(&simulation), velocities(&simulation));
    assert_eq!(&now[..count], &put[..]);
    assert!(speeds[..count].iter().all(|v| *v == [0.0; 3]));
    assert_eq!((&now[count..], &speeds[count..]), (&x[count..], &v[count..]));
    let mut stresses = vec![0.0; now.len()];
    simulation.read::<f64>(Field::StressNorms, &mut stresses);
    assert!(stresses[..count].iter().all(|stress| *stress < 1e-9), "it is without stress");
    advance(&mut simulation, 10);

    let few = Change::State { body: "still".to_owned(), positions: [[0.0; 3]].into(), velocities: None };
    let error = simulation.apply(std::slice::from_ref(&few)).expect_err("too few");
    assert!(matches!(error, ChangeError::WrongCount { found: 1, .. }), "{error}");
    let error = simulation.apply(&[few.clone(), Change::Drag(0.1), few]).expect_err("one state of a body");
    assert!(matches!(error, ChangeError::StateTwice { first: 0, second: 1, .. }), "{error}");
}

#[test]
fn snow_is_put_as_far_as_its_grid_reaches_and_no_farther() {
    for precision in Precision::ALL {
        let mut simulation = simulate(Variant::affine()[0], precision);
        let count = simulation.topology()[0].particle_count as usize;
        let at = |x: f64| {
            let mut positions = vec![[0.0, 5.0, 0.0]; count];
            positions[7][0] = x;
            Change::State { body: "still".to_owned(), positions: positions.into(), velocities: None }
        };
        // Cells of 0.1 m, four to a block, and four blocks before the last.
        let reach = f64::from((1 << 20) - 4) * 0.4;
        for x in [-450e3, 450e3, reach + 1.0] {
            let error = simulation.apply(&[at(x)]).expect_err("the grid has no such cell");
            let ChangeError::BeyondGrid { particle, value, reach: told, .. } = error else {
                panic!("{error}")
            };
            assert_eq!((particle, value), (7, x));
            assert!((told / reach - 1.0).abs() < 1e-12, "{told}");
            assert!(error.to_string().contains("the grid of the snow reaches 419428"), "{error}");
        }
        for x in [reach, -reach] {
            simulation.apply(&[at(x)]).expect("it is within");
            if let Err(error) = try_advance(&mut simulation, 1) {
                let message = error.to_string();
                assert!(!message.contains("NaN") && !message.contains("inf"), "{message}");
            }
        }
    }
}

#[test]
fn a_reset_is_the_start_whatever_came_before() {
    for variant in Variant::all() {
        for precision in Precision::ALL {
            let (mut new, mut used) = (simulate(variant, precision), simulate(variant, precision));
            used.apply(&[force("turning", &[1, 2], [0.0, 0.5, 0.0])]).expect("a fair force");
            advance(&mut used, 25);
            assert!(max_distance(&positions(&new), &positions(&used)) > 0.01);
            used.apply(&[Change::Reset]).expect("a reset");
            for _ in 0..3 {
                assert_eq!(positions(&new), positions(&used), "{}", variant.name());
                assert_eq!(velocities(&new), velocities(&used), "{}", variant.name());
                advance(&mut new, 20);
                advance(&mut used, 20);
            }
        }
    }
}

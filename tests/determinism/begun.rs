//! A simulation that begins at a frame of another one: the same bits from there, whatever the clock moves; or why it does not.

use std::sync::Arc;

use nappe_cluster::Cluster;
use nappe_sim::{
    cloth::Integrator,
    collide::{Pose, PoseKey, Way},
    field::Field,
    math::Precision,
    report::NoStopwatch,
    snow::{Kernel, Transfer},
    world::{BeginError, Beginning, CarriedError, Change, Missing, Simulation, TimedForce, WorldSetup},
};
use nappe_tests::{
    Method,
    ranks::on_ranks,
    scene::{advance, positions, velocities},
    snow::{SnowScene, Variant, elastic, lattice, object},
};

use crate::scenes::{changes, methods, scene};

/// Steps of every run.
const STEPS: u64 = 14;

/// A scene in which a gust, a force and the ways of its colliders go by the clock.
fn timed(name: &str, method: Method) -> WorldSetup {
    let mut setup = scene(name, method).setup();
    let dt = setup.dt;
    setup.wind_at = vec![(2.5 * dt, [0.0; 3]), (6.0 * dt, [3.0, 0.5, 1.0]), (11.0 * dt, [0.0, 0.0, 1.0])];
    let (from, until) = (3.25 * dt, 9.5 * dt);
    setup.bodies[0].forces.push(TimedForce { particles: vec![5, 7], force: [0.01, 0.02, 0.0], from, until });
    for collider in &mut setup.colliders {
        let Pose { position, .. } = collider.pose(0.0);
        let lifted = [position[0], position[1] + 0.004, position[2]];
        let key =
            |steps: f64, position| PoseKey { time: steps * dt, pose: Pose { position, turn: Pose::NO_TURN } };
        (collider.velocity, collider.way) =
            ([0.0; 3], Some(Way { keys: vec![key(1.5, position), key(12.0, lifted)] }));
    }
    setup
}

/// A pin on its way for longer than a run.
fn on_its_way(name: &str, dt: f64) -> Vec<Change> {
    let mut all = changes(name);
    all.retain(|change| matches!(change, Change::Pin { .. }));
    if let [Change::Pin { duration, .. }] = &mut all[..] {
        *duration = 21.0 * dt;
    }
    all
}

/// A simulation before its first step.
fn made(setup: &WorldSetup, precision: Precision, changes: &[Change]) -> Simulation {
    let (mut simulation, _) = Simulation::new(setup, precision).expect("it is in");
    simulation.apply(changes).expect("changes of the scene");
    simulation
}

/// What a frame holds of a simulation.
fn frame(of: &Simulation) -> Beginning {
    Beginning {
        step: of.step_count(),
        positions: positions(of).into(),
        velocities: velocities(of).into(),
        numbers: Some(of.carried().numbers),
    }
}

/// Cuts a run after some of its steps, and has another one go on from the frame there: with the same hash then, and the same
/// bits after every later step. Says how often, since there is nothing to compare where solves use patches.
fn cut_and_go_on(told: &str, setup: &WorldSetup, precision: Precision, changes: &[Change]) -> usize {
    let mut whole = made(setup, precision, changes);
    let mut begun: Vec<Simulation> = Vec::new();
    for step in 0..STEPS {
        let missing = whole.carried().missing;
        assert!(missing.iter().all(|missing| *missing == Missing::Patches), "{told}: {missing:?}");
        if [0, 1, 4, 9].contains(&step) && missing.is_empty() {
            let mut cut = made(setup, precision, changes);
            cut.begin(&frame(&whole)).unwrap_or_else(|error| panic!("{told}: {error}"));
            begun.push(cut);
        }
        for cut in &begun {
            assert_eq!(cut.state_hash(), whole.state_hash(), "{told}: step {step}");
            assert_eq!((cut.step_count(), cut.time()), (whole.step_count(), whole.time()));
        }
        for simulation in begun.iter_mut().chain([&mut whole]) {
            advance(simulation, 1);
        }
    }
    for cut in &begun {
        assert_eq!((cut.state_hash(), positions(cut)), (whole.state_hash(), positions(&whole)), "{told}");
    }
    begun.len()
}

#[test]
fn a_simulation_that_begins_at_a_frame_goes_on_with_the_same_bits() {
    let mut count = 0;
    for name in ["hung_sheet", "sheet_on_sphere", "carried_chain", "sheet_in_air", "sheet_in_tray"] {
        // The others go on from the step before.
        let alone = methods(name)
            .filter(|method| !matches!(method.integrator, Integrator::ImplicitMidpoint | Integrator::Bdf2));
        for (index, method) in alone.enumerate() {
            let setup = timed(name, method);
            let precision = Precision::ALL[index % Precision::ALL.len()];
            let told = format!("{name}, {}, {precision}", method.name());
            count += cut_and_go_on(&told, &setup, precision, &on_its_way(name, setup.dt));
        }
    }
    assert!(count > 100, "{count} frames");
}

#[test]
fn a_simulation_whose_steps_are_divided_goes_on_with_pins_within_a_sub_step() {
    let method = methods("carried_chain")
        .find(|method| method.integrator == Integrator::SymplecticEuler)
        .expect("a method");
    let mut within = 0.0;
    for (factor, precision) in [(7.0, Precision::F32), (11.0, Precision::F64), (13.0, Precision::F32)] {
        let mut chain = scene("carried_chain", method).certified();
        chain.dt *= factor;
        let setup = chain.setup();
        let duration = 21.0 * setup.dt;
        let changes = [Change::Pin { particle: 70, target: [1.35, 0.05, -0.02], duration }];
        cut_and_go_on(&format!("{factor} times as long"), &setup, precision, &changes);
        let mut simulation = made(&setup, precision, &changes);
        for _ in 0..STEPS {
            advance(&mut simulation, 1);
            // Of the pace seven, of what was gained four, of pins two, and then how many are within a sub-step.
            within += simulation.carried().numbers[13];
        }
    }
    assert!(within > 0.0, "no pin stood within a sub-step");
}

#[test]
fn ranks_go_on_from_the_state_of_a_simulation_that_began_at_a_frame() {
    let method = methods("hung_sheet")
        .find(|method| method.integrator == Integrator::ImplicitEuler)
        .expect("a method");
    let setup = timed("hung_sheet", method);
    for precision in Precision::ALL {
        let mut alone = made(&setup, precision, &[]);
        advance(&mut alone, 6);
        let mut begun = made(&setup, precision, &[]);
        begun.begin(&frame(&alone)).expect("a frame of the same setup");
        let state = begun.take();
        advance(&mut alone, STEPS);
        let work = |ranks: Arc<dyn Cluster>| {
            let (mut simulation, _) = Simulation::over(&setup, precision, ranks).expect("it is in");
            simulation.put(&state);
            for _ in 0..STEPS {
                simulation.step(&mut NoStopwatch).expect("it is stable");
            }
            let mut whole = made(&setup, precision, &[]);
            whole.put(&simulation.take());
            whole.state_hash()
        };
        for size in [2, 3] {
            assert_eq!(on_ranks(size, 1, work)[0].0, alone.state_hash(), "{size} ranks in {precision}");
        }
    }
}

#[test]
fn what_a_frame_does_not_hold_is_named() {
    let missing_of = |integrator: Integrator, warm_start: bool, called: &[Change]| {
        let method = methods("hung_sheet").find(|method| method.integrator == integrator);
        let mut setup = scene("hung_sheet", method.expect("a method")).setup();
        setup.bodies[0].settings.solver.warm_start = warm_start;
        let mut simulation = made(&setup, Precision::F32, &[]);
        advance(&mut simulation, 2);
        simulation.apply(called).expect("fair changes");
        simulation.carried().missing
    };
    assert!(missing_of(Integrator::ImplicitEuler, false, &[]).is_empty());
    assert_eq!(missing_of(Integrator::ImplicitEuler, true, &[]), [Missing::WarmStart]);
    assert_eq!(missing_of(Integrator::Bdf2, false, &[]), [Missing::Past]);
    for called in [Change::Gravity([0.0; 3]), Change::Wind([1.0, 0.0, 0.0]), Change::Drag(0.5)] {
        assert_eq!(missing_of(Integrator::SymplecticEuler, false, &[called]), [Missing::Calls]);
    }
    let names = Missing::ALL.map(Missing::name);
    assert!((1..names.len()).all(|at| !names[..at].contains(&names[at])), "{names:?}");
}

#[test]
fn frames_that_nothing_goes_on_from_are_refused() {
    let method = methods("carried_chain")
        .find(|method| method.integrator == Integrator::SymplecticEuler)
        .expect("a method");
    let setup = timed("carried_chain", method);
    let changes = on_its_way("carried_chain", setup.dt);
    let mut whole = made(&setup, Precision::F32, &changes);
    advance(&mut whole, 3);
    let good = frame(&whole);
    let refused = |at: &Beginning, changes: &[Change]| {
        made(&setup, Precision::F32, changes).begin(at).expect_err("it is refused")
    };

    let few = Beginning { velocities: vec![[0.0; 3]; 149].into(), ..good.clone() };
    let counted = BeginError::Count { found: 149, needed: 150, bodies: "body 150".to_owned() };
    assert_eq!(refused(&few, &changes), counted);
    let mut far = positions(&whole);
    far[7] = [f64::NAN; 3];
    let far = Beginning { positions: far.into(), ..good.clone() };
    assert!(matches!(refused(&far, &changes), BeginError::Change(_)));

    let numbers = good.numbers.clone().expect("there are some");
    let with = |place: usize, number: f64| {
        let mut numbers = numbers.clone();
        numbers[place] = number;
        Beginning { numbers: Some(numbers), ..good.clone() }
    };
    let short = Beginning { numbers: Some(numbers[1..].to_vec()), ..good.clone() };
    let long = Beginning { numbers: Some([&numbers[..], &[0.0]].concat()), ..good.clone() };
    for wrong in [short, long, with(0, 0.5), with(7, f64::INFINITY), with(13, -1.0), with(13, 1e300)] {
        let expected = BeginError::Carried(CarriedError::Numbers);
        assert_eq!(refused(&wrong, &changes), expected, "{:?}", wrong.numbers);
    }
    let pins = BeginError::Carried(CarriedError::Pins { bodies: "body".to_owned() });
    assert_eq!(refused(&good, &[]), pins, "no pin is sent in this scene");
    assert_eq!(refused(&with(12, 7.0), &changes), pins, "a pin of other points");
}

#[test]
fn snow_does_not_begin_at_a_frame() {
    let block =
        object("block", lattice([0.0; 3], [4; 3], [0.05; 3]), 0.05_f64.powi(3), 400.0, elastic(1.4e5, 0.2));
    let variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    let mut simulation = SnowScene::new(vec![block], 0.1, 1e-3).by(variant).simulate(Precision::F32);
    let error = simulation.begin(&frame(&simulation)).expect_err("it is snow");
    assert_eq!(error, BeginError::Snow { body: "block".to_owned() });
    let mut read = vec![0.0; 3 * simulation.particle_count()];
    simulation.read(Field::Positions, &mut read);
    assert!(read.iter().all(|number: &f64| number.is_finite()), "it stands where it stood");
}

//! Ranks that a server steps over a link: the same results, changes, failures, interrupts, and links that end.

mod job;
mod strangers;

use std::{
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use nappe_cluster::{RemoteError, VERSION};
use nappe_sim::{
    collide::Collider,
    field::Field,
    math::Precision,
    report::{NoStopwatch, Stage, StepFailure},
    world::{Change, Simulation, WorldSetup},
};
use nappe_tests::{
    Scene,
    meshes::torus,
    networks::{scatter, sheet, sheet_rules},
    threads::with_threads,
};

use job::ranks;

/// A sheet of ten blocks on two pins, shaken.
fn setup() -> WorldSetup {
    let mut network = sheet(17, 0.05, &sheet_rules(200.0, 0.02), 0.01);
    for (i, x) in network.x.iter_mut().enumerate().filter(|(i, _)| *i != 0 && *i != 16) {
        *x = [0, 1, 2].map(|c| x[c] + 0.004 * scatter(3 * i + c));
    }
    let mut scene = Scene::new(network, 5e-3).under([0.0, -9.81, 0.0]).certified();
    scene.settings.block_size = 32;
    scene.setup()
}

/// What happens to it after ten steps.
fn changes() -> Vec<Change> {
    let points = [(0.02, [0.1, 0.1, 0.0]), (0.04, [0.0, 0.2, 0.1])];
    vec![
        Change::Wind([2.0, 0.0, 1.0]),
        Change::Drag(0.002),
        Change::Springs { body: None, kind: None, stiffness: Some(150.0), damping: None },
        Change::PinPath { particle: 0, points: points.into() },
    ]
}

fn read(simulation: &Simulation, field: Field) -> Vec<f64> {
    let mut numbers = vec![0.0; field.width() * simulation.particle_count()];
    simulation.read(field, &mut numbers);
    numbers
}

#[test]
fn a_simulation_over_a_link_goes_as_one_in_the_process() {
    for precision in Precision::ALL {
        let (mut remote, handle) = ranks(3);
        assert_eq!((remote.hello().hosts.len(), remote.hello().version.as_str()), (3, VERSION));
        let (mut alone, warnings) = Simulation::new(&setup(), precision).expect("a sheet");
        let (mut copy, _) = Simulation::new(&setup(), precision).expect("a sheet");
        assert_eq!(remote.build(setup(), precision).expect("a sheet"), warnings);
        let mut asked = 0;
        for step in 0..30 {
            if step == 10 {
                alone.apply(&changes()).expect("they are accepted");
                remote.apply(changes()).expect("they are accepted");
            }
            let stepped = remote.step().expect("the link holds");
            let own = with_threads(1, || alone.step(&mut NoStopwatch));
            assert_eq!(stepped.result, own, "step {step}");
            assert_eq!(stepped.seconds.len(), Stage::ALL.len());
            assert!(stepped.seconds.iter().sum::<f64>() > 0.0 && stepped.asked.gathers > asked);
            asked = stepped.asked.gathers;
            if step % 7 == 0 {
                for field in Field::ALL.into_iter().filter(|field| !field.is_evaluated()) {
                    copy.put_field(&remote.look(field).expect("the link holds"));
                    let own = read(&alone, field);
                    assert_eq!(read(&copy, field), own, "{field:?} after step {step} in {precision}");
                }
                assert_ne!(copy.state_hash(), alone.state_hash(), "nothing but fields");
                copy.put(&remote.take().expect("the link holds"));
                assert_eq!(copy.state_hash(), alone.state_hash(), "step {step} in {precision}");
                for field in [Field::Forces, Field::Accelerations] {
                    assert_eq!(read(&copy, field), read(&alone, field), "{field:?} after step {step}");
                }
            }
        }
        // A copy goes on from where it was left, with the same bits.
        copy.put(&remote.take().expect("the link holds"));
        for simulation in [&mut copy, &mut alone] {
            for _ in 0..5 {
                with_threads(2, || simulation.step(&mut NoStopwatch)).expect("it is stable");
            }
        }
        assert_eq!(copy.state_hash(), alone.state_hash());
        remote.end().expect("the link holds");
        assert!(handle.join().expect("no rank fails"));
    }
}

#[test]
fn ranks_go_on_from_a_state_that_they_are_given() {
    for precision in Precision::ALL {
        let (mut remote, handle) = ranks(3);
        let (mut alone, _) = Simulation::new(&setup(), precision).expect("a sheet");
        for _ in 0..7 {
            with_threads(1, || alone.step(&mut NoStopwatch)).expect("it is stable");
        }
        remote.build(setup(), precision).expect("a sheet");
        let state = alone.take();
        // A simulation that is given a state evaluates it, which one that has stepped has done.
        let (mut alone, _) = Simulation::new(&setup(), precision).expect("a sheet");
        alone.put(&state);
        remote.put(state).expect("the link holds");
        for step in 0..10 {
            let own = with_threads(1, || alone.step(&mut NoStopwatch));
            assert_eq!(remote.step().expect("the link holds").result, own, "step {step} in {precision}");
        }
        let (mut copy, _) = Simulation::new(&setup(), precision).expect("a sheet");
        copy.put(&remote.take().expect("the link holds"));
        assert_eq!(copy.state_hash(), alone.state_hash(), "in {precision}");
        remote.end().expect("the link holds");
        assert!(handle.join().expect("no rank fails"));
    }
}

/// A sheet that falls on a ring of triangles which moves.
fn on_ring() -> WorldSetup {
    let mut network = sheet(17, 0.05, &sheet_rules(200.0, 0.02), 0.01);
    network.pins.clear();
    let ring = torus([0.41, -0.09, 0.4], 0.25, 0.08, [32, 16]).collider(0.4, 0.005);
    let mut scene = Scene::new(network, 2e-3).under([0.0, -9.81, 0.0]).certified();
    scene.settings.block_size = 32;
    scene.colliders = vec![Collider { velocity: [0.3, 0.2, -0.1], ..ring }];
    scene.setup()
}

#[test]
fn cloth_on_a_solid_goes_over_a_link_as_in_the_process() {
    for precision in Precision::ALL {
        let (mut remote, handle) = ranks(3);
        let (mut alone, warnings) = Simulation::new(&on_ring(), precision).expect("a sheet");
        let (mut copy, _) = Simulation::new(&on_ring(), precision).expect("a sheet");
        assert_eq!(remote.build(on_ring(), precision).expect("a sheet"), warnings);
        let mut touched = 0;
        for step in 0..40 {
            let stepped = remote.step().expect("the link holds");
            let own = with_threads(1, || alone.step(&mut NoStopwatch));
            assert_eq!(stepped.result, own, "step {step}");
            touched += own.expect("it is stable").contact_count;
        }
        assert!(touched > 20, "{touched} contacts");
        copy.put(&remote.take().expect("the link holds"));
        assert_eq!(copy.state_hash(), alone.state_hash(), "in {precision}");
        remote.end().expect("the link holds");
        assert!(handle.join().expect("no rank fails"));
    }
}

#[test]
fn what_ranks_refuse_comes_back_in_words_and_they_go_on() {
    let (mut remote, handle) = ranks(2);
    let mut bad = setup();
    bad.dt = -1.0;
    let refused = remote.build(bad, Precision::F64).expect_err("a step backwards");
    assert!(refused.to_string().contains("dt is -1"), "{refused}");
    remote.build(setup(), Precision::F64).expect("a sheet");
    let refused = remote.apply(vec![Change::Drag(-1.0)]).expect_err("a drag below 0");
    assert!(matches!(&refused, RemoteError::Refused(words) if words.contains("drag")), "{refused}");
    remote.step().expect("the link holds").result.expect("it is stable");
    remote.end().expect("the link holds");
    assert!(handle.join().expect("no rank fails"));
}

/// A sheet whose step of the world has many thousand sub-steps.
fn long_setup() -> WorldSetup {
    let mut long = setup();
    long.dt = 1.0;
    long.bodies[0].settings.time_step = nappe_sim::time_step::TimeStep::Unchecked(1.1e-4);
    long
}

#[test]
fn a_stop_of_the_process_that_waits_for_ranks_loses_none_of_them() {
    let long = WorldSetup { dt: 0.2, ..long_setup() };
    let (mut alone, _) = Simulation::new(&long, Precision::F32).expect("a sheet");
    let (mut remote, handle) = ranks(2);
    remote.build(long, Precision::F32).expect("a sheet");
    // From outside, since this process cannot end a stop of its own. It waits for the answer meanwhile.
    let script = "for _ in 1 2 3; do sleep 0.05; kill -STOP \"$0\"; sleep 0.05; kill -CONT \"$0\"; done";
    let mut stops = Command::new("sh");
    stops.args(["-c", script, &std::process::id().to_string()]).stdin(Stdio::null());
    let mut stops = stops.spawn().expect("a shell starts");
    let stepped = remote.step().expect("the link holds");
    assert_eq!(stepped.result, with_threads(1, || alone.step(&mut NoStopwatch)));
    assert!(stops.wait().expect("it ends").success());
    remote.end().expect("the link holds");
    assert!(handle.join().expect("no rank fails"));
}

#[test]
fn an_interrupt_acts_within_a_step() {
    let (mut remote, handle) = ranks(2);
    remote.build(long_setup(), Precision::F64).expect("a sheet");
    let orders = remote.orders();
    let asks = thread::spawn(move || {
        thread::sleep(Duration::from_millis(100));
        orders.interrupt().expect("the link holds");
        Instant::now()
    });
    let end = remote.step().expect("the link holds").result.expect_err("it was given up");
    assert_eq!(end.failure, StepFailure::Interrupted);
    let asked = asks.join().expect("it asks");
    assert!(asked.elapsed() < Duration::from_secs(20), "{:?}", asked.elapsed());
    remote.end().expect("the link holds");
    assert!(handle.join().expect("no rank fails"));
}

#[test]
fn a_link_that_ends_aborts_the_ranks() {
    let (mut remote, handle) = ranks(3);
    remote.build(setup(), Precision::F32).expect("a sheet");
    drop(remote);
    assert!(handle.join().is_err(), "its link ended");
}

//! The same bits where particles are pulled: threads, ranks, a fork and a state in the middle.

use std::sync::Arc;

use nappe_cluster::Cluster;
use nappe_sim::{
    math::Precision,
    report::NoStopwatch,
    world::{Change, Pull, Simulation},
};
use nappe_tests::{
    Method,
    ranks::on_ranks,
    threads::{THREAD_COUNTS, with_threads},
};

use crate::scenes::{changes, methods, scene};

/// A sheet of 400 particles in air, on some of which forces of calls act.
const SCENE: &str = "sheet_in_air";

fn draw(particles: &[u32], to: [f64; 3], seconds: f64) -> Change {
    Change::Pull(Pull {
        body: "body".to_owned(),
        particles: particles.into(),
        points: vec![to; particles.len()].into(),
        frequency: 200.0,
        most: 300.0,
        seconds,
    })
}

/// Particles all over the sheet, which different ranks compute.
const PATCH: [u32; 8] = [399, 5, 63, 64, 127, 210, 250, 338];

fn begin(simulation: &mut Simulation) {
    simulation.apply(&changes(SCENE)).expect("a force");
    step(simulation, 2);
    simulation.apply(&[draw(&PATCH, [0.4, 0.2, 0.5], 0.012)]).expect("a fair pull");
    step(simulation, 5);
}

/// Some are drawn elsewhere, some are let go, and the others end by themselves.
fn go_on(simulation: &mut Simulation) {
    let ended = Pull {
        body: "body".to_owned(),
        particles: [64].into(),
        points: [].into(),
        frequency: 0.0,
        most: 0.0,
        seconds: 0.0,
    };
    let drawn = draw(&PATCH[..3], [0.2, -0.3, 0.1], 0.004);
    simulation.apply(&[drawn, Change::Pull(ended)]).expect("fair pulls");
    step(simulation, 10);
}

fn step(simulation: &mut Simulation, count: u32) {
    for _ in 0..count {
        simulation.step(&mut NoStopwatch).expect("it is stable");
    }
}

/// What a run leads to, which forks in the middle: both hashes are the same, and those of the middle and the end.
fn run(method: Method, precision: Precision) -> [u64; 2] {
    let mut simulation = scene(SCENE, method).simulate(precision);
    begin(&mut simulation);
    let (mut fork, mut put) = (simulation.fork(), scene(SCENE, method).simulate(precision));
    put.put(&simulation.take());
    let middle = simulation.state_hash();
    assert_eq!([fork.state_hash(), put.state_hash()], [middle; 2]);
    for simulation in [&mut simulation, &mut fork, &mut put] {
        go_on(simulation);
    }
    let end = simulation.state_hash();
    assert_eq!([fork.state_hash(), put.state_hash()], [end; 2], "{}", method.name());
    [middle, end]
}

#[test]
fn pulls_have_the_same_bits_on_any_number_of_threads_and_ranks() {
    let mut compared = 0;
    for method in methods(SCENE) {
        for precision in Precision::ALL {
            let alone = with_threads(1, || run(method, precision));
            for threads in &THREAD_COUNTS[1..] {
                assert_eq!(with_threads(*threads, || run(method, precision)), alone, "{}", method.name());
            }
            if method.is_by_sweeps() {
                continue;
            }
            for size in [2, 3] {
                let work = |ranks: Arc<dyn Cluster>| {
                    let setup = scene(SCENE, method).setup();
                    let (mut simulation, _) = Simulation::over(&setup, precision, ranks).expect("it is in");
                    let whole = |simulation: &Simulation| {
                        let mut whole = scene(SCENE, method).simulate(precision);
                        whole.put(&simulation.take());
                        whole.state_hash()
                    };
                    begin(&mut simulation);
                    let middle = whole(&simulation);
                    go_on(&mut simulation);
                    [middle, whole(&simulation)]
                };
                let found = on_ranks(size, 1 + size % 2, work)[0].0;
                assert_eq!(found, alone, "{} on {size} ranks", method.name());
                compared += 1;
            }
        }
    }
    assert!(compared > 10, "{compared} runs over ranks");
}

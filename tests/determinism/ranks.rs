//! The same bits over ranks, which are threads here: every run of cloth that several ranks can step.

use std::sync::Arc;

use nappe_sim::{math::Precision, parallel::Communicator, report::NoStopwatch, world::Simulation};
use nappe_tests::{Method, ranks::on_ranks};

use crate::{
    hashes::{committed, runs},
    scenes::{STEPS, changes, scene},
};

/// Numbers of ranks over which results must not change.
const RANK_COUNTS: [usize; 4] = [2, 3, 4, 7];

/// Whether several ranks can step a run.
fn is_in(name: &str, method: Method) -> bool {
    name != "coarse_spaces" && !method.is_by_sweeps()
}

/// Steps a scene as one of several ranks; its state, whole on rank 0, in a simulation of its own.
fn run(name: &str, method: Method, precision: Precision, communicator: Arc<dyn Communicator>) -> u64 {
    let setup = scene(name, method).setup();
    let (mut simulation, _) = Simulation::over(&setup, precision, communicator).expect("it is in");
    simulation.apply(&changes(name)).expect("changes of the scene");
    for _ in 0..STEPS {
        simulation.step(&mut NoStopwatch).expect("it is stable");
    }
    let (mut whole, _) = Simulation::new(&setup, precision).expect("it is in");
    whole.put(&simulation.take());
    whole.state_hash()
}

#[test]
fn every_run_has_its_committed_hash_over_ranks() {
    let committed = committed();
    let mut compared = 0;
    for (key, name, method, precision) in
        runs().into_iter().filter(|(_, name, method, _)| is_in(name, *method))
    {
        for size in RANK_COUNTS {
            for threads in [1, 2] {
                let (hash, _) = on_ranks(size, threads, |ranks| run(name, method, precision, ranks));
                assert_eq!(committed.get(&key), Some(&hash), "{key} on {size} ranks of {threads} threads");
                compared += 1;
            }
        }
    }
    assert!(compared > 300, "{compared} runs");
}

//! Steps of cloth over ranks, which are threads here: what is allocated outside of what they ask of each other.

use std::sync::{Arc, Barrier};

use nappe_cluster::Cluster;
use nappe_sim::{
    math::Precision,
    parallel::{Communicator, Message},
    report::NoStopwatch,
    world::Simulation,
};
use nappe_tests::{Scene, ranks::on_ranks_that_divide};

use crate::counting::{allocations, uncounted, warm_up};

/// Ranks, and threads of each.
const RANKS: usize = 3;
const THREADS: usize = 2;

/// A communicator whose own allocations do not count.
#[derive(Debug)]
struct Apart(Arc<dyn Cluster>);

impl Apart {
    fn ask<T>(&self, call: impl FnOnce(&dyn Cluster) -> T) -> T {
        uncounted(|| call(&*self.0))
    }
}

impl Communicator for Apart {
    fn rank(&self) -> usize {
        self.0.rank()
    }

    fn size(&self) -> usize {
        self.0.size()
    }

    fn all_gather(&self, own: &[u8], lengths: &[usize], all: &mut Vec<u8>) {
        // As MPI does, which receives where there is room.
        let length = lengths.iter().sum();
        all.resize(length, 0);
        self.ask(|ranks| {
            let mut received = Vec::new();
            ranks.all_gather(own, lengths, &mut received);
            all.copy_from_slice(&received);
        });
    }

    fn divides_from(&self) -> usize {
        self.0.divides_from()
    }

    fn exchange(&self, messages: &mut [Message]) {
        self.ask(|ranks| ranks.exchange(messages));
    }

    fn gather(&self, own: &[u8], lengths: &[usize]) -> Vec<u8> {
        self.ask(|ranks| ranks.gather(own, lengths))
    }
}

/// Allocations of five steps after the first two, by all ranks together, which divide a coarse space from so many blocks on:
/// the fewest of three times.
pub(crate) fn count(scene: &Scene, precision: Precision, divides_from: usize) -> u64 {
    let (setup, barrier) = (scene.setup(), Barrier::new(RANKS));
    let counts = on_ranks_that_divide(divides_from, RANKS, THREADS, |ranks| {
        warm_up(THREADS);
        let made = Simulation::over(&setup, precision, Arc::new(Apart(ranks)));
        let (mut simulation, _) = made.expect("ranks can step it");
        let mut steps = |count: u32| {
            for _ in 0..count {
                simulation.step(&mut NoStopwatch).expect("a stable step");
            }
        };
        steps(2);
        let mut least = u64::MAX;
        for _ in 0..3 {
            barrier.wait();
            let before = allocations();
            barrier.wait();
            steps(5);
            barrier.wait();
            least = least.min(allocations() - before);
        }
        least
    });
    counts[0].0
}

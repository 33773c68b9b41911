//! Steps over ranks, which are threads here: what is allocated outside of what they ask of each other.

use std::sync::{
    Arc, Barrier,
    atomic::{AtomicU64, Ordering},
};

use nappe_cluster::Cluster;
use nappe_sim::{
    math::Precision,
    parallel::{Communicator, Message},
    report::NoStopwatch,
    world::{Simulation, WorldSetup},
};
use nappe_tests::{Scene, ranks::on_ranks_that_divide, snow::SnowScene};

use crate::counting::{allocations, uncounted, warm_up};

/// Ranks that step a cloth, and threads of each rank.
const RANKS: usize = 3;
const THREADS: usize = 2;
/// From how many blocks ranks divide what they could as well all do, where it makes no difference.
const USUAL_BLOCKS: usize = 64;
/// Steps that are counted together, and how often at most.
const STEPS: u32 = 5;
const TIMES: u32 = 8;

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
        // As MPI does, which receives where there is room.
        self.ask(|ranks| {
            let mut exchanged = messages.to_vec();
            ranks.exchange(&mut exchanged);
            for (message, exchanged) in messages.iter_mut().zip(&exchanged) {
                message.received.copy_from_slice(&exchanged.received);
            }
        });
    }

    fn gather(&self, own: &[u8], lengths: &[usize]) -> Vec<u8> {
        self.ask(|ranks| ranks.gather(own, lengths))
    }
}

/// Allocations of five steps of cloth after the first two, by ranks that divide a coarse space from so many blocks on.
pub(crate) fn count(scene: &Scene, precision: Precision, divides_from: usize) -> u64 {
    fewest(&scene.setup(), precision, [RANKS, divides_from], 2)
}

/// The same of snow by so many ranks, after those steps in which lists find their length.
pub(crate) fn count_of_snow(scene: &SnowScene, precision: Precision, ranks: usize) -> u64 {
    fewest(&scene.setup(), precision, [ranks, USUAL_BLOCKS], 20)
}

/// Allocations by all ranks together after the first `warm` steps: the fewest of several times. What a step allocates, it does every
/// time; a list grows where more goes from rank to rank than before.
fn fewest(setup: &WorldSetup, precision: Precision, [size, divides_from]: [usize; 2], warm: u32) -> u64 {
    let (barrier, least) = (Barrier::new(size), AtomicU64::new(u64::MAX));
    on_ranks_that_divide(divides_from, size, THREADS, |ranks| {
        warm_up(THREADS);
        let made = Simulation::over(setup, precision, Arc::new(Apart(ranks)));
        let (mut simulation, _) = made.expect("ranks can step it");
        let mut steps = |count: u32| {
            for _ in 0..count {
                simulation.step(&mut NoStopwatch).expect("a stable step");
            }
        };
        steps(warm);
        for _ in 0..TIMES {
            barrier.wait();
            let before = allocations();
            barrier.wait();
            steps(STEPS);
            // One counts for all, so that all end together.
            if barrier.wait().is_leader() {
                least.fetch_min(allocations() - before, Ordering::Relaxed);
            }
            barrier.wait();
            if least.load(Ordering::Relaxed) == 0 {
                break;
            }
        }
    });
    least.into_inner()
}

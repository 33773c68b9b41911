//! Ranks that are processes of an MPI job.
//!
//! No handle is kept: each call looks at the world of the process. Errors of MPI end the job, and so does a rank that panics:
//! unwinding would leave the others waiting for ever.

use std::{
    thread,
    time::{Duration, Instant},
};

use ::mpi::{
    Threading,
    datatype::PartitionMut,
    environment::{Universe, processor_name},
    point_to_point::MatchedReceiveVec as _,
    request::multiple_scope,
    topology::SimpleCommunicator,
    traits::{Communicator as _, CommunicatorCollectives as _, Destination as _, Root as _, Source as _},
};
use nappe_sim::parallel::{Communicator, Message};
use rustix::process::getpgrp;

use crate::{cluster::Cluster, message::RankPlace};

/// Tags: particles for neighbours, and what rank 0 tells all.
const EXCHANGE: i32 = 1;
const BROADCAST: i32 = 2;

/// How long a rank that waits for rank 0 looks again and again, before it sleeps in between.
const EAGER: Duration = Duration::from_millis(5);
/// How long it sleeps at a time.
const SLEEP: Duration = Duration::from_micros(500);

/// A process of an MPI job.
#[derive(Debug)]
pub struct Mpi {
    rank: usize,
    size: usize,
    places: Vec<RankPlace>,
}

impl Mpi {
    /// Joins the job that this process was started in. It ends with the value beside it, which is dropped last.
    ///
    /// # Errors
    /// When MPI was begun before, or serves one thread alone.
    pub fn join() -> Result<(Universe, Self), String> {
        let (universe, threading) =
            ::mpi::initialize_with_threading(Threading::Serialized).ok_or("MPI was begun before")?;
        if threading < Threading::Serialized {
            return Err(format!("this MPI serves one thread alone ({threading:?})"));
        }
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |cause| {
            usual(cause);
            abort();
        }));
        let world = SimpleCommunicator::world();
        let (rank, size) = (world.rank() as usize, world.size() as usize);
        let mut joined = Self { rank, size, places: Vec::new() };
        joined.places = joined.gather_places(&processor_name().unwrap_or_default());
        Ok((universe, joined))
    }

    /// Where each rank runs, on rank 0.
    fn gather_places(&self, host: &str) -> Vec<RankPlace> {
        let own = [host.len() as u32, std::process::id(), getpgrp().as_raw_pid() as u32].map(f64::from);
        let mut all = Vec::new();
        self.gather(&own, &vec![own.len(); self.size], &mut all);
        let numbers: Vec<[u32; 3]> =
            all.as_chunks::<3>().0.iter().map(|own| own.map(|number| number as u32)).collect();
        let lengths: Vec<usize> = numbers.iter().map(|[length, ..]| *length as usize).collect();
        let names = self.collect(host.as_bytes(), &lengths);
        let mut rest = &names[..];
        let place = |[length, process, group]: [u32; 3]| {
            let (name, after) = rest.split_at_checked(length as usize)?;
            rest = after;
            Some(RankPlace { host: String::from_utf8_lossy(name).into_owned(), process, group })
        };
        numbers.into_iter().map_while(place).collect()
    }
}

/// Ends all ranks of the job.
pub fn abort() {
    SimpleCommunicator::world().abort(1);
}

/// Counts, and where each part begins, as MPI has them.
fn parts(lengths: &[usize]) -> (Vec<i32>, Vec<i32>) {
    let count = |length: &usize| i32::try_from(*length).expect("parts of at most 2 GiB");
    let counts: Vec<i32> = lengths.iter().map(count).collect();
    let starts = counts.iter().scan(0_i32, |next, count| {
        let start = *next;
        *next = start.checked_add(*count).expect("at most 2 GiB together");
        Some(start)
    });
    let starts = starts.collect();
    (counts, starts)
}

impl Communicator for Mpi {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn gather(&self, own: &[f64], lengths: &[usize], all: &mut Vec<f64>) {
        let (counts, starts) = parts(lengths);
        all.clear();
        all.resize(lengths.iter().sum(), 0.0);
        let mut all = PartitionMut::new(&mut all[..], counts, starts);
        SimpleCommunicator::world().all_gather_varcount_into(own, &mut all);
    }

    fn exchange(&self, messages: &mut [Message]) {
        let world = SimpleCommunicator::world();
        multiple_scope(2 * messages.len(), |scope, requests| {
            for Message { rank, sent, received } in messages {
                let other = world.process_at_rank(*rank as i32);
                requests.add(other.immediate_receive_into_with_tag(scope, &mut received[..], EXCHANGE));
                requests.add(other.immediate_send_with_tag(scope, &sent[..], EXCHANGE));
            }
            requests.wait_all(&mut Vec::new());
        });
    }

    fn collect(&self, own: &[u8], lengths: &[usize]) -> Vec<u8> {
        let world = SimpleCommunicator::world();
        let root = world.process_at_rank(0);
        // An empty list of bytes may stand at address 1, which MPI takes for a sign (MPI_IN_PLACE).
        let own = if own.is_empty() { &[0][..0] } else { own };
        if self.rank > 0 {
            root.gather_varcount_into(own);
            return Vec::new();
        }
        let (counts, starts) = parts(lengths);
        let total = lengths.iter().sum();
        let mut all = Vec::with_capacity(total + 1);
        all.resize(total, 0);
        root.gather_varcount_into_root(own, &mut PartitionMut::new(&mut all[..], counts, starts));
        all
    }
}

impl Cluster for Mpi {
    fn broadcast(&self, bytes: &mut Vec<u8>) {
        let world = SimpleCommunicator::world();
        if self.rank == 0 {
            for rank in 1..self.size {
                world.process_at_rank(rank as i32).send_with_tag(&bytes[..], BROADCAST);
            }
            return;
        }
        // MPI waits by looking again and again, which takes a whole core.
        let (begin, root) = (Instant::now(), world.process_at_rank(0));
        let message = loop {
            if let Some(message) = root.immediate_matched_probe_with_tag(BROADCAST) {
                break message;
            }
            if begin.elapsed() > EAGER {
                thread::sleep(SLEEP);
            } else {
                thread::yield_now();
            }
        };
        *bytes = message.matched_receive_vec().0;
    }

    fn places(&self) -> Vec<RankPlace> {
        self.places.clone()
    }
}

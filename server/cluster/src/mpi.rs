//! Ranks that are processes of an MPI job.
//!
//! No handle is kept: each call looks at the world of the process. Errors of MPI end the job, and so does a rank that panics:
//! unwinding would leave the others waiting for ever.

use std::{
    sync::{Mutex, PoisonError},
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
    traits::{Communicator as _, CommunicatorCollectives as _, Destination as _, Source as _},
};
use nappe_sim::parallel::{Communicator, Message};

use crate::cluster::Cluster;

/// Tags: particles for neighbours, what rank 0 tells all, and what all tell rank 0.
const EXCHANGE: i32 = 1;
const BROADCAST: i32 = 2;
const GATHER: i32 = 3;

/// How long a rank that waits for rank 0 looks again and again, before it sleeps in between.
const EAGER: Duration = Duration::from_millis(5);
/// How long it sleeps at a time.
const SLEEP: Duration = Duration::from_micros(500);

/// Bytes of a message, at most, where as many may be sent as anybody likes: MPI counts in 31 bits.
const PIECE: usize = 64 << 20;

/// A process of an MPI job.
#[derive(Debug)]
pub struct Mpi {
    rank: usize,
    size: usize,
    hosts: Vec<String>,
    /// Counts of an all-gather, and where each part begins; kept for the next one.
    parts: Mutex<[Vec<i32>; 2]>,
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
        let mut joined = Self { rank, size, hosts: Vec::new(), parts: Mutex::default() };
        joined.hosts = joined.gather_hosts(&processor_name().unwrap_or_default());
        Ok((universe, joined))
    }

    /// The host of each rank, on rank 0, when each tells its own.
    fn gather_hosts(&self, own: &str) -> Vec<String> {
        let mut all = Vec::new();
        self.all_gather(&(own.len() as u32).to_le_bytes(), &vec![size_of::<u32>(); self.size], &mut all);
        let lengths = all.as_chunks::<4>().0.iter().map(|length| u32::from_le_bytes(*length) as usize);
        let lengths: Vec<usize> = lengths.collect();
        let names = self.gather(own.as_bytes(), &lengths);
        let mut rest = &names[..];
        let host = |length: usize| {
            let (name, after) = rest.split_at_checked(length)?;
            rest = after;
            Some(String::from_utf8_lossy(name).into_owned())
        };
        lengths.into_iter().map_while(host).collect()
    }
}

/// Ends all ranks of the job.
pub fn abort() {
    SimpleCommunicator::world().abort(1);
}

/// Writes counts, and where each part begins, as MPI has them.
fn measure(lengths: &[usize], [counts, starts]: &mut [Vec<i32>; 2]) {
    counts.clear();
    starts.clear();
    let mut start = 0_i32;
    for length in lengths {
        let count = i32::try_from(*length).expect("parts of at most 2 GiB");
        counts.push(count);
        starts.push(start);
        start = start.checked_add(count).expect("at most 2 GiB together");
    }
}

/// Sends bytes to a rank that knows how many come.
fn send(bytes: &[u8], rank: usize, tag: i32) {
    let world = SimpleCommunicator::world();
    for piece in bytes.chunks(PIECE) {
        world.process_at_rank(rank as i32).send_with_tag(piece, tag);
    }
}

/// Receives as many bytes as there is room for.
fn receive(bytes: &mut [u8], rank: usize, tag: i32) {
    let world = SimpleCommunicator::world();
    for piece in bytes.chunks_mut(PIECE) {
        world.process_at_rank(rank as i32).receive_into_with_tag(piece, tag);
    }
}

impl Communicator for Mpi {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn all_gather(&self, own: &[u8], lengths: &[usize], all: &mut Vec<u8>) {
        let mut parts = self.parts.lock().unwrap_or_else(PoisonError::into_inner);
        measure(lengths, &mut parts);
        let [counts, starts] = &*parts;
        all.resize(lengths.iter().sum(), 0);
        let mut all = PartitionMut::new(&mut all[..], &counts[..], &starts[..]);
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

    fn gather(&self, own: &[u8], lengths: &[usize]) -> Vec<u8> {
        if self.rank > 0 {
            send(own, 0, GATHER);
            return Vec::new();
        }
        let mut all = own.to_vec();
        all.resize(lengths.iter().sum(), 0);
        let mut rest = &mut all[own.len()..];
        for (rank, length) in lengths.iter().enumerate().skip(1) {
            let (part, after) = rest.split_at_mut(*length);
            receive(part, rank, GATHER);
            rest = after;
        }
        all
    }
}

impl Cluster for Mpi {
    fn broadcast(&self, bytes: &mut Vec<u8>) {
        let world = SimpleCommunicator::world();
        if self.rank == 0 {
            for rank in 1..self.size {
                world.process_at_rank(rank as i32).send_with_tag(&bytes.len().to_le_bytes(), BROADCAST);
                send(bytes, rank, BROADCAST);
            }
            return;
        }
        // MPI waits by looking again and again, which takes a whole core.
        let (begin, root) = (Instant::now(), world.process_at_rank(0));
        let length = loop {
            if let Some(message) = root.immediate_matched_probe_with_tag(BROADCAST) {
                break message.matched_receive_vec::<u8>().0;
            }
            if begin.elapsed() > EAGER {
                thread::sleep(SLEEP);
            } else {
                thread::yield_now();
            }
        };
        let length = length.try_into().map(usize::from_le_bytes).expect("a length comes first");
        // A setup is long, and what follows it short: its room is given back.
        *bytes = vec![0; length];
        receive(bytes, 0, BROADCAST);
    }

    fn hosts(&self) -> Vec<String> {
        self.hosts.clone()
    }
}

//! Ranks that are threads, each with a pool of its own: what they ask of each other goes through memory.
//!
//! A rank that waits for the others for 20 s ends with the name of its call: so a decision that one rank makes alone shows.

use std::{
    collections::BTreeMap,
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use nappe_cluster::Cluster;
use nappe_sim::parallel::{Communicator, Message};

use crate::threads::pool;

/// How long a rank waits for the others.
const PATIENCE: Duration = Duration::from_secs(20);

/// What the ranks share.
#[derive(Debug, Default)]
struct Shared {
    board: Mutex<Board>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Board {
    /// Bytes from one rank to another that nobody has received, in their order.
    letters: BTreeMap<(usize, usize), Vec<Vec<u8>>>,
    /// A rank that ended in a failure.
    lost: Option<usize>,
}

/// One of several ranks.
#[derive(Debug)]
struct Rank {
    number: usize,
    size: usize,
    divides_from: usize,
    parts_drawn_from: Option<u64>,
    shared: Arc<Shared>,
    counts: Mutex<Counts>,
}

/// What a rank asked of the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Calls of all-gather.
    pub gathers: u64,
    /// Bytes that it told in these.
    pub told: u64,
    /// Calls of exchange.
    pub exchanges: u64,
    /// Messages in these.
    pub messages: u64,
    /// Bytes of these.
    pub bytes: u64,
    /// Bytes that it gave to the last gather on rank 0.
    pub given: u64,
}

impl Shared {
    fn board(&self) -> MutexGuard<'_, Board> {
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn send(&self, way: (usize, usize), bytes: Vec<u8>) {
        self.board().letters.entry(way).or_default().push(bytes);
        self.changed.notify_all();
    }

    fn receive(&self, way: (usize, usize), call: &str) -> Vec<u8> {
        self.receive_within(PATIENCE, way, call)
    }

    fn receive_within(&self, patience: Duration, way: (usize, usize), call: &str) -> Vec<u8> {
        let end = Instant::now() + patience;
        let mut board = self.board();
        loop {
            if let Some(letters) = board.letters.get_mut(&way).filter(|letters| !letters.is_empty()) {
                return letters.remove(0);
            }
            if let Some(lost) = board.lost {
                drop(board);
                panic!("rank {} is in {call}, and rank {lost} failed", way.1);
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                board.lost = Some(way.1);
                drop(board);
                panic!("rank {} waits in {call} for rank {}", way.1, way.0);
            }
            board = self.changed.wait_timeout(board, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Rank {
    fn count(&self, change: impl FnOnce(&mut Counts)) {
        change(&mut self.counts.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

impl Communicator for Rank {
    fn rank(&self) -> usize {
        self.number
    }

    fn size(&self) -> usize {
        self.size
    }

    fn all_gather(&self, own: &[u8], lengths: &[usize], all: &mut Vec<u8>) {
        self.count(|counts| {
            counts.gathers += 1;
            counts.told += own.len() as u64;
        });
        assert_eq!(own.len(), lengths[self.number], "the length that was told");
        let others = || (0..self.size).filter(|rank| *rank != self.number);
        others().for_each(|rank| self.shared.send((self.number, rank), own.to_vec()));
        all.clear();
        for (rank, length) in lengths.iter().enumerate() {
            if rank == self.number {
                all.extend(own);
                continue;
            }
            let bytes = self.shared.receive((rank, self.number), "all_gather");
            assert_eq!(bytes.len(), *length, "rank {rank} is in another call than rank {}", self.number);
            all.extend(bytes);
        }
    }

    fn divides_from(&self) -> usize {
        self.divides_from
    }

    fn parts_drawn_from(&self) -> Option<u64> {
        self.parts_drawn_from
    }

    fn exchange(&self, messages: &mut [Message]) {
        for message in &*messages {
            self.shared.send((self.number, message.rank), message.sent.clone());
        }
        for message in messages {
            let bytes = self.shared.receive((message.rank, self.number), "exchange");
            assert_eq!(bytes.len(), message.received.len(), "rank {} is in another call", message.rank);
            self.count(|counts| {
                counts.messages += 1;
                counts.bytes += message.sent.len() as u64;
            });
            message.received = bytes;
        }
        self.count(|counts| counts.exchanges += 1);
    }

    fn gather(&self, own: &[u8], lengths: &[usize]) -> Vec<u8> {
        assert_eq!(own.len(), lengths[self.number], "the length that was told");
        self.count(|counts| counts.given = own.len() as u64);
        if self.number > 0 {
            self.shared.send((self.number, 0), own.to_vec());
            return Vec::new();
        }
        let others = (1..self.size).flat_map(|rank| self.shared.receive((rank, 0), "gather"));
        own.iter().copied().chain(others).collect()
    }
}

impl Cluster for Rank {
    fn broadcast(&self, bytes: &mut Vec<u8>) {
        if self.number == 0 {
            (1..self.size).for_each(|rank| self.shared.send((0, rank), bytes.clone()));
        } else {
            // Rank 0 may have nothing to say for as long as a test does other things.
            *bytes = self.shared.receive_within(10 * PATIENCE, (0, self.number), "broadcast");
        }
    }

    fn hosts(&self) -> Vec<String> {
        if self.number == 0 { vec!["thread".to_owned(); self.size] } else { Vec::new() }
    }
}

/// How many blocks ranks must have so that they divide work on a coarse space: none, and more than there are.
pub const DIVIDES_FROM: [usize; 2] = [0, usize::MAX];

/// Does the same work on some ranks, each with as many threads; what each returns, and what it asked of the others.
///
/// # Panics
/// As the work of any rank does.
pub fn on_ranks<T: Send>(
    size: usize,
    threads: usize,
    work: impl Fn(Arc<dyn Cluster>) -> T + Sync,
) -> Vec<(T, Counts)> {
    on_ranks_that_divide(64, size, threads, work)
}

/// The same with ranks that divide work on a coarse space from so many blocks on.
///
/// # Panics
/// As the work of any rank does.
pub fn on_ranks_that_divide<T: Send>(
    divides_from: usize,
    size: usize,
    threads: usize,
    work: impl Fn(Arc<dyn Cluster>) -> T + Sync,
) -> Vec<(T, Counts)> {
    on_ranks_of((divides_from, None), size, threads, work)
}

/// The same with ranks that begin with parts of snow which are drawn, from an odd seed with some that are empty.
///
/// # Panics
/// As the work of any rank does.
pub fn on_ranks_with_drawn_parts<T: Send>(
    seed: u64,
    size: usize,
    threads: usize,
    work: impl Fn(Arc<dyn Cluster>) -> T + Sync,
) -> Vec<(T, Counts)> {
    on_ranks_of((64, Some(seed)), size, threads, work)
}

fn on_ranks_of<T: Send>(
    (divides_from, parts_drawn_from): (usize, Option<u64>),
    size: usize,
    threads: usize,
    work: impl Fn(Arc<dyn Cluster>) -> T + Sync,
) -> Vec<(T, Counts)> {
    let shared = Arc::new(Shared::default());
    let rank = |number| {
        let (shared, counts) = (Arc::clone(&shared), Mutex::default());
        Arc::new(Rank { number, size, divides_from, parts_drawn_from, shared, counts })
    };
    let ranks: Vec<Arc<Rank>> = (0..size).map(rank).collect();
    let results: Vec<_> = thread::scope(|scope| {
        let run = |rank: &Arc<Rank>| {
            let (own, shared, work) = (Arc::clone(rank), &shared, &work);
            scope.spawn(move || {
                let number = own.number;
                let run = || pool(threads).install(|| work(own));
                std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).inspect_err(|_| {
                    shared.board().lost.get_or_insert(number);
                    shared.changed.notify_all();
                })
            })
        };
        let handles: Vec<_> = ranks.iter().map(run).collect();
        handles.into_iter().map(|handle| handle.join().expect("a panic is caught")).collect()
    });
    let counts = ranks.iter().map(|rank| *rank.counts.lock().unwrap_or_else(PoisonError::into_inner));
    let results =
        results.into_iter().map(|result| result.unwrap_or_else(|cause| std::panic::resume_unwind(cause)));
    results.zip(counts).collect()
}

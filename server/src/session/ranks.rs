//! Ranks that step a session: told what to do over a link, ended with the session.
//!
//! Enters: a setup, changes, the wish for a step or a state. Leaves: steps and states, or that a rank is lost.

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread,
    time::Duration,
};

use nappe_cluster::{Asked, Link, Meeting, Orders, Remote, RemoteError, Stepped, Token};
use nappe_proto::v1;
use nappe_sim::{
    field::Field,
    interrupt::Interrupt,
    math::Precision,
    world::{Change, TakenField, WorldSetup, WorldState},
};

use super::launcher::{Group, Job, TICK, listen, not_started, program};
use crate::{
    config::RankSettings,
    error::{Reason, ServiceError},
};

/// How long ranks of a session that is deleted may take to give up what they do, and any to say that they end.
const PATIENCE: Duration = Duration::from_millis(250);
/// How long those of a session that is stopped may take, which keeps what they computed: with each million of particles as
/// long again.
const STOP_PATIENCE: Duration = Duration::from_secs(1);
/// How long a job may take to end by itself, once it said that it does.
const FAREWELL: Duration = Duration::from_millis(600);
/// How long a launcher may take to say which rank was lost.
const LAST_WORDS: Duration = Duration::from_millis(1500);

/// How many ranks, with how many threads each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RankCounts {
    pub ranks: u32,
    pub threads: u32,
}

/// What ranks step.
pub(super) struct Begin<'a> {
    pub setup: &'a WorldSetup,
    pub precision: Precision,
    /// Changes that are applied before the first step.
    pub changes: &'a [Change],
    /// What they go on from, if they do not begin at the start of the setup.
    pub begun: Option<WorldState>,
}

/// What ends ranks, or what they are doing.
pub(super) struct Watched {
    /// Gives up their start.
    pub start: Interrupt,
    /// Gives up the step in progress.
    pub steps: Interrupt,
    /// Whether the session is deleted: nobody looks at it any more.
    pub is_deleted: Box<dyn Fn() -> bool + Send>,
    /// Called once if the launcher ends by itself.
    pub on_end: Box<dyn Fn() + Send>,
}

/// What the thread that steps and the one that watches know of each other.
#[derive(Debug, Default)]
struct Watch {
    /// Whether nothing is watched any more.
    is_over: AtomicBool,
    /// Questions and answers so far: odd while an answer is waited for.
    turns: AtomicU64,
    /// Whether the link was cut since no answer came.
    is_cut: AtomicBool,
}

impl Watch {
    /// A question, or the answer to it.
    fn turn(&self) {
        self.turns.fetch_add(1, Ordering::Relaxed);
    }
}

/// Ranks that step a session; they end with this value.
pub(super) struct Ranks {
    /// None once they ended.
    remote: Option<Remote>,
    job: Job,
    counts: RankCounts,
    hosts: Vec<String>,
    asked: Asked,
    watch: Arc<Watch>,
}

impl Ranks {
    /// Starts ranks and has them build the same simulation; the strings are their warnings. `count` is told how many of
    /// them run on this host, before they take memory.
    ///
    /// # Errors
    /// When there is no launcher or program, or they do not start, or refuse the setup; or when `count` refuses.
    pub(super) fn start(
        settings: &RankSettings,
        counts: RankCounts,
        begin: &Begin<'_>,
        watched: Watched,
        count: impl FnOnce(u64) -> Result<(), ServiceError>,
    ) -> Result<(Self, Vec<String>), ServiceError> {
        let program = program(settings)?;
        let mut token = Token::default();
        getrandom::fill(&mut token).map_err(|error| not_started(&error))?;
        let (listener, address) = listen(&settings.link_address).map_err(|error| not_started(&error))?;
        let silence = Duration::from_secs(settings.rank_silence.into());
        let meeting = Meeting::new(listener, token, silence).map_err(|error| not_started(&error))?;
        let link = Link { address, token, threads: counts.threads as usize };
        let job = Job::launch(settings, &program, counts.ranks, &link)?;
        let remote = job.meet(meeting, &watched.start)?;

        let hosts = remote.hello().hosts.clone();
        let (orders, is_watched) = (remote.orders(), Arc::<Watch>::default());
        let of_snow = begin.setup.snow.iter().flat_map(|snow| &snow.objects).map(|object| object.x.len());
        let of_cloths = begin.setup.bodies.iter().map(|body| body.network.x.len());
        let particles: usize = of_cloths.chain(of_snow).sum();
        let patience = STOP_PATIENCE.mul_f64(1.0 + particles as f64 / 1e6);
        watch(watched, orders, job.group(), Arc::clone(&is_watched), patience).map_err(|error| {
            not_started(&format!("the system starts no thread that watches them: {error}"))
        })?;
        let remote = Some(remote);
        let mut ranks = Self { remote, job, counts, hosts, asked: Asked::default(), watch: is_watched };

        let system = rustix::system::uname();
        let here = ranks.hosts.iter().filter(|host| host.as_bytes() == system.nodename().to_bytes()).count();
        count(here as u64)?;
        let remote = ranks.remote()?;
        let warnings =
            remote.build(begin.setup.clone(), begin.precision).map_err(|error| not_started(&error))?;
        remote.apply(begin.changes.to_vec()).map_err(|error| not_started(&error))?;
        if let Some(state) = &begin.begun {
            remote.put(state.clone()).map_err(|error| not_started(&error))?;
        }
        Ok((ranks, warnings))
    }

    fn remote(&mut self) -> Result<&mut Remote, ServiceError> {
        self.remote.as_mut().ok_or_else(|| ServiceError::new(Reason::RankLost, "the ranks have ended"))
    }

    /// A rank is gone: nothing more is asked of the others.
    pub(super) fn lost(&mut self, error: &impl std::fmt::Display) -> ServiceError {
        self.watch.is_over.store(true, Ordering::Relaxed);
        self.remote = None;
        let error = if self.watch.is_cut.load(Ordering::Relaxed) {
            let mut hosts = self.hosts.clone();
            hosts.sort_unstable();
            hosts.dedup();
            format!("the ranks on {} did not give up their step when they were told to", hosts.join(", "))
        } else {
            self.job.wait(LAST_WORDS);
            error.to_string()
        };
        let message = format!("a rank was lost: {error}{}", self.job.last_lines());
        ServiceError::new(Reason::RankLost, message)
    }

    fn ask<T>(&mut self, ask: impl FnOnce(&mut Remote) -> Result<T, RemoteError>) -> Result<T, ServiceError> {
        self.watch.turn();
        let answer = ask(self.remote()?);
        self.watch.turn();
        answer.map_err(|error| self.lost(&error))
    }

    /// Applies changes, which were applied to the copy of the server.
    ///
    /// # Errors
    /// When a rank is lost.
    pub(super) fn apply(&mut self, changes: &[Change]) -> Result<(), ServiceError> {
        self.ask(|remote| remote.apply(changes.to_vec()))
    }

    /// Takes a step.
    ///
    /// # Errors
    /// When a rank is lost; a step that is not taken is a result.
    pub(super) fn step(&mut self) -> Result<Stepped, ServiceError> {
        let stepped = self.ask(Remote::step)?;
        self.asked = stepped.asked;
        Ok(stepped)
    }

    /// The state as it is.
    ///
    /// # Errors
    /// When a rank is lost.
    pub(super) fn take(&mut self) -> Result<WorldState, ServiceError> {
        self.ask(Remote::take)
    }

    /// A field as it is.
    ///
    /// # Errors
    /// When a rank is lost.
    pub(super) fn look(&mut self, field: Field) -> Result<TakenField, ServiceError> {
        self.ask(|remote| remote.look(field))
    }

    /// What is told of them.
    pub(super) fn describe(&self) -> v1::SessionRanks {
        v1::SessionRanks {
            rank_count: self.counts.ranks,
            thread_count: self.counts.threads,
            hosts: self.hosts.clone(),
            message_count: self.asked.messages,
            message_bytes: self.asked.bytes,
            gather_count: self.asked.gathers,
        }
    }
}

impl Drop for Ranks {
    fn drop(&mut self) {
        self.watch.is_over.store(true, Ordering::Relaxed);
        // Ranks that do not answer are killed with their job.
        if let Some(remote) = self.remote.take()
            && remote.end_within(PATIENCE).is_ok()
        {
            self.job.wait(FAREWELL);
        }
    }
}

/// Hands interrupts on to ranks, and closes their link when they do not answer one within `patience`, or the launcher ends,
/// so that nobody waits for an answer: in a thread of its own.
///
/// # Errors
/// When the system starts no thread.
fn watch(
    watched: Watched,
    orders: Orders,
    group: Group,
    shared: Arc<Watch>,
    patience: Duration,
) -> io::Result<()> {
    let Watched { start, steps, is_deleted, on_end } = watched;
    let body = move || {
        // Since ranks were told to give up, how long one answer has been waited for: looks are counted, since the clock also
        // counts a stop of this process, after which the answer may be there.
        let (mut is_told, mut turns, mut waited) = (false, 0, Duration::ZERO);
        while !shared.is_over.load(Ordering::Relaxed) {
            if start.is_requested() {
                return orders.cut();
            }
            if steps.is_requested() {
                if !is_told {
                    interrupt(&orders);
                    is_told = true;
                }
                let before = turns;
                turns = shared.turns.load(Ordering::Relaxed);
                let is_same = turns == before && turns % 2 == 1;
                waited = if is_same { waited + TICK } else { Duration::ZERO };
                let patience = if is_deleted() { PATIENCE } else { patience };
                if waited > patience {
                    shared.is_cut.store(true, Ordering::Relaxed);
                    return orders.cut();
                }
            }
            if group.has_ended() {
                orders.cut();
                return on_end();
            }
            thread::sleep(TICK);
        }
    };
    thread::Builder::new().spawn(body).map(drop)
}

/// Sends an interrupt, in a thread of its own: a rank 0 that hangs may not have read the order before.
fn interrupt(orders: &Orders) {
    let orders = orders.clone();
    // A link that is gone shows where answers are waited for.
    thread::spawn(move || drop(orders.interrupt()));
}

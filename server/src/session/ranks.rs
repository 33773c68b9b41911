//! Ranks that step a session: told what to do over a link, ended with the session.
//!
//! Enters: a setup, changes, the wish for a step or a state. Leaves: steps and states, or that a rank is lost.

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

use nappe_cluster::{Asked, Link, Orders, Remote, RemoteError, Stepped, Token};
use nappe_proto::v1;
use nappe_sim::{
    interrupt::Interrupt,
    math::Precision,
    world::{Change, Positions, WorldSetup, WorldState},
};

use super::launcher::{Group, Job, TICK, listen, not_started, program};
use crate::{
    config::RankSettings,
    error::{Reason, ServiceError},
};

/// How long ranks may take to end by themselves.
const FAREWELL: Duration = Duration::from_secs(2);
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
}

/// What ends ranks, or what they are doing.
pub(super) struct Watched {
    /// Gives up their start.
    pub start: Interrupt,
    /// Gives up the step in progress.
    pub steps: Interrupt,
    /// Called once if the launcher ends by itself.
    pub on_end: Box<dyn Fn() + Send>,
}

/// Ranks that step a session; they end with this value.
pub(super) struct Ranks {
    /// None once they ended.
    remote: Option<Remote>,
    job: Job,
    counts: RankCounts,
    hosts: Vec<String>,
    asked: Asked,
    /// Told when nothing is watched any more.
    is_over: Arc<AtomicBool>,
}

impl Ranks {
    /// Starts ranks and has them build the same simulation. `count` is told how many of them run on this host, before
    /// they take memory.
    ///
    /// # Errors
    /// When there is no launcher or program, or they do not start, or refuse the setup; or when `count` refuses.
    pub(super) fn start(
        settings: &RankSettings,
        counts: RankCounts,
        begin: &Begin<'_>,
        watched: Watched,
        count: impl FnOnce(u64) -> Result<(), ServiceError>,
    ) -> Result<Self, ServiceError> {
        let program = program(settings)?;
        let mut token = Token::default();
        getrandom::fill(&mut token).map_err(|error| not_started(&error))?;
        let (listener, address) = listen(&settings.link_address).map_err(|error| not_started(&error))?;
        let link = Link { address, token, threads: counts.threads as usize };
        let job = Job::launch(settings, &program, counts.ranks, &link)?;
        let remote = job.meet(&listener, token, &watched.start)?;
        drop(listener);

        let hosts = remote.hello().hosts.clone();
        let (orders, is_over) = (remote.orders(), Arc::new(AtomicBool::new(false)));
        watch(watched, orders, job.group(), Arc::clone(&is_over)).map_err(|error| {
            not_started(&format!("the system starts no thread that watches them: {error}"))
        })?;
        let mut ranks = Self { remote: Some(remote), job, counts, hosts, asked: Asked::default(), is_over };

        let system = rustix::system::uname();
        let here = ranks.hosts.iter().filter(|host| host.as_bytes() == system.nodename().to_bytes()).count();
        count(here as u64)?;
        let remote = ranks.remote()?;
        let built = remote.build(begin.setup.clone(), begin.precision);
        built
            .and_then(|_warnings| remote.apply(begin.changes.to_vec()))
            .map_err(|error| not_started(&error))?;
        Ok(ranks)
    }

    fn remote(&mut self) -> Result<&mut Remote, ServiceError> {
        self.remote.as_mut().ok_or_else(|| ServiceError::new(Reason::RankLost, "the ranks have ended"))
    }

    /// A rank is gone: nothing more is asked of the others.
    pub(super) fn lost(&mut self, error: &impl std::fmt::Display) -> ServiceError {
        self.is_over.store(true, Ordering::Relaxed);
        self.remote = None;
        self.job.wait(LAST_WORDS);
        let message = format!("a rank was lost: {error}{}", self.job.last_lines());
        ServiceError::new(Reason::RankLost, message)
    }

    fn ask<T>(&mut self, ask: impl FnOnce(&mut Remote) -> Result<T, RemoteError>) -> Result<T, ServiceError> {
        ask(self.remote()?).map_err(|error| self.lost(&error))
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

    /// Where particles are.
    ///
    /// # Errors
    /// When a rank is lost.
    pub(super) fn look(&mut self) -> Result<Positions, ServiceError> {
        self.ask(Remote::look)
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
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(remote) = self.remote.take() {
            // Ranks that do not answer are killed all the same.
            let _ = remote.end_within(FAREWELL);
            self.job.wait(FAREWELL);
        }
    }
}

/// Hands interrupts on to ranks, and closes their link when the launcher ends, so that nobody waits for an answer: in a
/// thread of its own.
///
/// # Errors
/// When the system starts no thread.
fn watch(watched: Watched, orders: Orders, group: Group, is_over: Arc<AtomicBool>) -> io::Result<()> {
    let Watched { start, steps, on_end } = watched;
    let body = move || {
        let mut is_told = false;
        while !is_over.load(Ordering::Relaxed) {
            if start.is_requested() {
                return orders.cut();
            }
            if steps.is_requested() && !is_told {
                is_told = true;
                // A link that is gone shows where answers are waited for.
                let _ = orders.interrupt();
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

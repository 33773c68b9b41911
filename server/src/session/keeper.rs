//! The thread that writes what a session keeps of itself in a folder, while the session goes on.
//!
//! Enters: states that were taken. Leaves: files that are whole. It also looks whether the next state is due, and has the log written
//! through to the disk, once a second: the end of the program alone loses nothing of it, the loss of power does.

use std::{
    error::Error,
    fs::File,
    io,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        mpsc::{self, Receiver, RecvTimeoutError, Sender},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use super::{
    control::Control,
    keep::{Keep, Order},
    taken::Taken,
};
use crate::{
    config::Limits,
    memory::Claim,
    state::{Digest, Goal, SessionFolder, StatePlace, bytes_to_write_without_setup, write_without_setup},
};

/// How often the log is written through to the disk.
const SYNC: Duration = Duration::from_secs(1);
/// How often it is looked whether a state is due.
const LOOKS: [Duration; 2] = [Duration::from_millis(10), Duration::from_millis(250)];
/// Looks in the time between two states.
const LOOKS_PER_STATE: u32 = 8;

/// Where sessions are kept, and how often.
#[derive(Clone, Debug)]
pub(super) struct KeepPlace {
    pub folder: SessionFolder,
    /// Time between two states, if something happened.
    pub interval: Duration,
    /// What stands in the folder already.
    pub newest: StatePlace,
    /// What the session is to do.
    pub goal: Goal,
}

/// Starts the thread that writes, for a session that is to be kept.
///
/// # Errors
/// If the system starts no thread.
pub(super) fn keep(control: &Arc<Control>, place: KeepPlace, limits: &Limits) -> io::Result<Keep> {
    let KeepPlace { folder, interval, newest, goal } = place;
    let (sender, orders) = mpsc::channel();
    let control = Arc::clone(control);
    let writer = Writer { control, folder: folder.clone(), limits: limits.clone(), interval, setup: None };
    let thread = thread::Builder::new().name("keep".to_owned());
    let threads: (Sender<Order>, JoinHandle<()>) = (sender, thread.spawn(move || writer.run(&orders))?);
    Ok(Keep::new(folder, threads, newest, goal))
}

/// What the thread that writes knows.
struct Writer {
    control: Arc<Control>,
    folder: SessionFolder,
    limits: Limits,
    interval: Duration,
    /// The setup of the session, once it is written.
    setup: Option<Digest>,
}

impl Writer {
    /// Runs until it is told to end, or the session is gone.
    fn run(mut self, orders: &Receiver<Order>) {
        let [shortest, longest] = LOOKS;
        let pause = (self.interval / LOOKS_PER_STATE).clamp(shortest, longest);
        let mut synced = Instant::now();
        loop {
            match orders.recv_timeout(pause) {
                Ok(Order::Write { place, taken, memory, waiting }) => {
                    let write = || self.write(place, *taken, &memory).map_err(|error| error.to_string());
                    // A panic in it was told where it happened.
                    let written = catch_unwind(AssertUnwindSafe(write))
                        .unwrap_or_else(|_panic| Err("writing it panicked".to_owned()));
                    if written.is_err() {
                        // It may be gone with the rest.
                        self.setup = None;
                    }
                    drop(memory);
                    self.control.state_written(written);
                    drop(waiting);
                }
                Ok(Order::Remove) => return self.remove(),
                Ok(Order::End) | Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => {}
            }
            self.control.ask_if_due(self.interval);
            if synced.elapsed() >= SYNC {
                synced = Instant::now();
                self.sync();
            }
        }
    }

    /// Writes a state; how many bytes it takes.
    fn write(&mut self, place: StatePlace, taken: Taken, memory: &Claim) -> Result<u64, Box<dyn Error>> {
        let control = Arc::clone(&self.control);
        let properties = &control.status.properties;
        memory.grow(taken.pending.bytes())?;
        // The log before it counts until the state is there.
        self.sync();
        let setup = if let Some(setup) = self.setup.filter(|setup| self.folder.has_setup(*setup)) {
            setup
        } else {
            let building = memory.another();
            let section = properties.origin.setup_section(&self.limits, &building)?;
            *self.setup.insert(self.folder.put_setup(&section)?)
        };
        let mut saved = taken.saved(properties, setup);
        if let Some(request) = saved.request.as_mut().filter(|_| properties.is_copy) {
            // That of another session: who sends it again does not mean this one.
            request.request_id.clear();
        }
        memory.grow(bytes_to_write_without_setup(&saved)?)?;
        let bytes = write_without_setup(&saved)?;
        drop(saved);
        self.folder.put_state(place, &bytes)?;
        self.folder.forget_older()?;
        Ok(bytes.len() as u64)
    }

    fn sync(&self) {
        let synced = self.control.unsynced_logs().iter().try_for_each(File::sync_data);
        if let Err(error) = synced {
            self.control.not_synced(&error);
        }
    }

    fn remove(&self) {
        if let Err(error) = self.folder.remove() {
            tracing::warn!("{} cannot be removed: {error}", self.folder.path().display());
        }
    }
}

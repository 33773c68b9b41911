//! The runtime of tokio that a program runs on: a worker per logical core, or why the system does not start them.

use std::{io, sync::Mutex, thread};

use tokio::runtime::{Builder, Runtime};

use crate::config::core_count;

/// A runtime with a worker per logical core. `TOKIO_WORKER_THREADS` changes nothing.
///
/// # Errors
/// When the system does not start as many threads, or refuses something else.
pub fn runtime() -> io::Result<Runtime> {
    let count = core_count() as usize;
    // tokio panics where a worker cannot be started. One more is tried, since one that ended counts a moment longer.
    try_threads(count + 1)?;
    Builder::new_multi_thread().worker_threads(count).enable_all().build()
}

/// Has so many threads run at a time.
///
/// # Errors
/// When the system does not start them.
fn try_threads(count: usize) -> io::Result<()> {
    let gate = &Mutex::new(());
    let tried: io::Result<()> = thread::scope(|scope| {
        // Nobody passes until all are there.
        let closed = gate.lock();
        let start = |_| thread::Builder::new().spawn_scoped(scope, move || drop(gate.lock()));
        let started: io::Result<Vec<_>> = (0..count).map(start).collect();
        drop(closed);
        for thread in started? {
            // It did nothing that could panic.
            let _ = thread.join();
        }
        Ok(())
    });
    tried.map_err(|error| {
        let what = format!("the system does not start {count} threads: {error}");
        io::Error::new(error.kind(), format!("{what}. Raise the limit on threads or processes"))
    })
}

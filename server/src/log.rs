//! The log of a program: lines wait in a bounded queue for a thread of its own, which writes them to standard error.
//!
//! Who logs neither waits nor fails. A line for which there is no room, or that cannot be written, is dropped and counted;
//! the log says how many before the next line that it can write, and at the end.

use std::{
    backtrace::{Backtrace, BacktraceStatus},
    collections::VecDeque,
    env,
    io::{self, IsTerminal as _, Write},
    mem,
    panic::{self, PanicHookInfo},
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread,
    time::Duration,
};

use thiserror::Error;
use tracing_subscriber::{EnvFilter, filter::ParseError};

/// Bytes of lines that may wait; what comes beyond them is dropped.
const QUEUE_BYTES: usize = 1 << 20;
/// How long the end of a program waits for its last lines, which nobody may ever read.
const FAREWELL: Duration = Duration::from_millis(500);

/// The log of this program, which ends with this value: lines that wait are then written, in half a second at most.
#[derive(Debug)]
pub struct Log(Arc<Queue>);

/// Why there is no log.
#[derive(Debug, Error)]
pub enum LogError {
    /// What is to be logged cannot be read.
    #[error(
        "--log {filter:?} (NAPPE_LOG) cannot be read: {source}. Allowed are off, error, warn, info, debug and trace, for \
         all or for a part (nappe_server=debug), with commas between several"
    )]
    Filter {
        /// What was given.
        filter: String,
        /// What is wrong with it.
        source: ParseError,
    },
    /// The system starts no thread.
    #[error("the system starts no thread for the log: {0}. Raise the limit on threads or processes")]
    Thread(#[source] io::Error),
    /// This program has a log.
    #[error("this program has a log already: {0}")]
    Second(#[source] Box<dyn std::error::Error + Send + Sync>),
}

impl Log {
    /// Logs from now on what a filter lets through, in the syntax of tracing; panics too, so that a thread that panics
    /// does not wait for a reader of standard error.
    ///
    /// # Errors
    /// When the filter cannot be read, the system starts no thread, or there is a log.
    pub fn start(filter: &str) -> Result<Self, LogError> {
        let parsed = EnvFilter::try_new(filter)
            .map_err(|source| LogError::Filter { filter: filter.to_owned(), source })?;
        let log = Self(Arc::default());
        let queue = Arc::clone(&log.0);
        thread::Builder::new()
            .name("log".to_owned())
            .spawn(move || queue.write_lines(&mut io::stderr()))
            .map_err(LogError::Thread)?;

        let is_plain = env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        tracing_subscriber::fmt()
            .with_env_filter(parsed)
            .with_ansi(io::stderr().is_terminal() && !is_plain)
            .with_writer(Arc::clone(&log.0))
            // It would tell of an error by a macro that panics where standard error cannot be written.
            .log_internal_errors(false)
            .try_init()
            .map_err(LogError::Second)?;
        panic::set_hook(Box::new(log_panic));
        Ok(log)
    }
}

impl Drop for Log {
    fn drop(&mut self) {
        self.0.finish(FAREWELL);
    }
}

/// Logs a panic as the standard library tells of it.
fn log_panic(panic: &PanicHookInfo<'_>) {
    let thread = thread::current();
    let name = thread.name().unwrap_or("<unnamed>");
    let trace = Backtrace::capture();
    if trace.status() == BacktraceStatus::Captured {
        tracing::error!("thread '{name}' {panic}\n{trace}");
    } else {
        tracing::error!("thread '{name}' {panic}");
    }
}

/// Lines on their way to standard error.
#[derive(Debug, Default)]
struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    lines: VecDeque<Vec<u8>>,
    /// Bytes of all lines that wait.
    bytes: usize,
    /// Lines that were dropped and not told yet.
    dropped: u64,
    /// Whether the program ends.
    is_closed: bool,
    /// Whether the thread has written all that it ever will.
    is_done: bool,
}

impl Queue {
    fn state(&self) -> MutexGuard<'_, State> {
        // Each change of it is whole.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn push(&self, line: &[u8]) {
        let mut state = self.state();
        if state.bytes + line.len() > QUEUE_BYTES {
            state.dropped += 1;
            return;
        }
        state.bytes += line.len();
        state.lines.push_back(line.to_vec());
        drop(state);
        self.changed.notify_all();
    }

    /// The next line, none when the queue is closed and empty; and how many were dropped, which is to be told before it.
    fn next(&self) -> (Option<Vec<u8>>, u64) {
        let waits = |state: &mut State| state.lines.is_empty() && !state.is_closed;
        let mut state = self.changed.wait_while(self.state(), waits).unwrap_or_else(PoisonError::into_inner);
        let line = state.lines.pop_front();
        state.bytes -= line.as_ref().map_or(0, Vec::len);
        (line, mem::take(&mut state.dropped))
    }

    /// Writes lines as they come, until the queue is closed and empty.
    fn write_lines(&self, out: &mut impl Write) {
        // A line that was cut off is not gone on with.
        let mut is_torn = false;
        loop {
            let (line, dropped) = self.next();
            let mut lost = 0;
            if dropped > 0 {
                let start = if is_torn { "\n" } else { "" };
                let told = format!(
                    "{start}log lines dropped: {dropped}; they came faster than they were read, or could not be written\n"
                );
                is_torn = out.write_all(told.as_bytes()).is_err();
                lost += if is_torn { dropped } else { 0 };
            }
            if let Some(line) = &line {
                let is_lost = out.write_all(line).is_err();
                is_torn |= is_lost;
                lost += u64::from(is_lost);
            }
            let mut state = self.state();
            state.dropped += lost;
            if line.is_none() {
                state.is_done = true;
                drop(state);
                return self.changed.notify_all();
            }
        }
    }

    /// Waits until all lines are written, so long at most.
    fn finish(&self, patience: Duration) {
        let mut state = self.state();
        state.is_closed = true;
        self.changed.notify_all();
        // What is not written by then never is: the program ends all the same.
        drop(self.changed.wait_timeout_while(state, patience, |state| !state.is_done));
    }
}

/// Each write is one line: a subscriber writes each event at once.
impl Write for &Queue {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        self.push(line);
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Refuses the first bytes that are written, as a full disk does until there is room.
    struct Full {
        refusals: usize,
        written: Vec<u8>,
    }

    impl Write for Full {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if self.refusals > 0 {
                self.refusals -= 1;
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.written.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// What is written of a queue that is closed, when so many writes are refused first.
    fn written(queue: &Queue, refusals: usize) -> String {
        queue.state().is_closed = true;
        let mut out = Full { refusals, written: Vec::new() };
        queue.write_lines(&mut out);
        assert!(queue.state().is_done);
        String::from_utf8(out.written).expect("a text")
    }

    #[test]
    fn lines_that_could_not_be_written_are_counted_as_soon_as_there_is_room() {
        let queue = Queue::default();
        for line in ["a\n", "b\n", "c\n"] {
            queue.push(line.as_bytes());
        }
        // Refused are the first line, then word of it and the second line.
        let text = written(&queue, 3);
        assert!(text.starts_with("\nlog lines dropped: 2;"), "{text}");
        assert!(text.ends_with("\nc\n") && text.lines().count() == 3, "{text}");
    }

    #[test]
    fn lines_beyond_the_room_of_the_queue_are_counted_and_take_no_memory() {
        let queue = Queue::default();
        let line = [b'x'; 1 << 10];
        for _ in 0..QUEUE_BYTES / line.len() + 7 {
            queue.push(&line);
        }
        assert_eq!(queue.state().bytes, QUEUE_BYTES);
        let text = written(&queue, 0);
        assert!(text.starts_with("log lines dropped: 7;"), "{}", &text[..80]);
        assert_eq!(text.matches('x').count(), QUEUE_BYTES);
        assert_eq!(queue.state().bytes, 0);
    }

    #[test]
    fn what_is_lost_last_is_told_at_the_end() {
        let queue = Queue::default();
        queue.push(b"a\n");
        assert!(written(&queue, 1).starts_with("\nlog lines dropped: 1;"));
    }

    #[test]
    fn the_end_does_not_wait_for_a_writer_that_never_comes() {
        let queue = Queue::default();
        queue.push(b"a\n");
        queue.finish(Duration::from_millis(1));
        assert!(!queue.state().is_done);
    }
}

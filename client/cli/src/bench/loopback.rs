//! What the system itself takes for the bytes of a stream: plain writes over loopback. A server's times are read beside
//! it.

use std::{
    io::{Read as _, Write as _},
    net::{Ipv4Addr, TcpListener, TcpStream},
    thread,
    time::{Duration, Instant},
};

use super::process;
use crate::words::error::{CliError, Result};

/// Frames that are sent in turn, as many as keep a processor's cache from holding them all.
const FRAMES: usize = 16;

/// What is sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Load {
    pub readers: usize,
    pub frame_bytes: usize,
    pub frames_per_second: f64,
    pub time: Duration,
}

/// Processor time per gigabyte (s) of a thread that writes frames to readers and does nothing else.
///
/// # Errors
/// When loopback cannot be used, or the system has no `/proc`.
pub(super) fn cpu_seconds_per_gb(load: Load) -> Result<f64> {
    let started = thread::Builder::new().spawn(move || write_all(load));
    let thread = started.map_err(|error| failure(&format!("the system starts no thread: {error}")))?;
    thread.join().unwrap_or_else(|_panic| Err(failure(&"a thread panicked")))
}

/// The thread that is measured.
fn write_all(load: Load) -> Result<f64> {
    let mut readers = connect(load.readers).map_err(|error| failure(&error))?;
    let frames: Vec<u8> = (0..FRAMES * load.frame_bytes).map(|byte| byte as u8).collect();
    let (begin, used) = (Instant::now(), process::thread_seconds()?);
    let mut sent = 0.0;
    for (count, frame) in frames.chunks(load.frame_bytes).cycle().enumerate() {
        let due = Duration::from_secs_f64(count as f64 / load.frames_per_second);
        if due >= load.time {
            break;
        }
        thread::sleep(due.saturating_sub(begin.elapsed()));
        for reader in &mut readers {
            reader.write_all(frame).map_err(|error| failure(&error))?;
            sent += frame.len() as f64;
        }
    }
    Ok((process::thread_seconds()? - used) / (sent / 1e9))
}

/// Connections whose other ends are read by a thread each, until they are closed.
fn connect(readers: usize) -> std::io::Result<Vec<TcpStream>> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    let address = listener.local_addr()?;
    let connection = |_| {
        let mut reader = TcpStream::connect(address)?;
        thread::Builder::new().spawn(move || {
            let mut buffer = vec![0; 1 << 18];
            while reader.read(&mut buffer).is_ok_and(|read| read > 0) {}
        })?;
        let (writer, _) = listener.accept()?;
        writer.set_nodelay(true)?;
        Ok(writer)
    };
    (0..readers).map(connection).collect()
}

fn failure(error: &dyn std::fmt::Display) -> CliError {
    CliError::failure(format!("cannot measure plain writes over loopback: {error}"))
}

//! The signals that ask a program to end: SIGINT (Ctrl-C), SIGTERM and SIGHUP (its terminal closed). The first asks, the
//! second ends it. SIGXFSZ does not.

use std::io;

/// Exit code of a program that a second signal ended.
const INTERRUPTED: i32 = 130;
/// What a closed terminal is called. It may come twice, from the terminal and from its shell, so a second one ends nothing.
const HANGUP: &str = "SIGHUP";

/// Has a write beyond the limit on the size of files fail from now on, as one onto a full disk does: SIGXFSZ, which the
/// system then sends, would end the program without a word.
///
/// # Errors
/// If the system does not let the program catch it.
#[cfg(unix)]
pub fn outlive_file_limits() -> io::Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    // The handler stays when this runtime is gone.
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let _entered = runtime.enter();
    signal(SignalKind::from_raw(rustix::process::Signal::XFSZ.as_raw())).map(drop)
}

/// Does nothing: such a write fails by itself on this system.
///
/// # Errors
/// None on this system.
#[cfg(not(unix))]
pub fn outlive_file_limits() -> io::Result<()> {
    Ok(())
}

/// Signals, caught from the moment that this is made: make it before telling anybody the address.
#[derive(Debug)]
pub struct Signals {
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
    /// None where the program was started so that it outlives its terminal, as nohup does.
    #[cfg(unix)]
    hangup: Option<tokio::signal::unix::Signal>,
}

impl Signals {
    /// Catches the signals from now on.
    ///
    /// # Errors
    /// If the system does not let the program catch them.
    #[cfg(unix)]
    pub fn listen() -> io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        // Where nothing tells, it is not ignored.
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let hangup = SignalKind::hangup();
        let is_caught = !is_ignored(&status, hangup.as_raw_value());
        Ok(Self {
            interrupt: signal(SignalKind::interrupt())?,
            terminate: signal(SignalKind::terminate())?,
            hangup: if is_caught { Some(signal(hangup)?) } else { None },
        })
    }

    /// Catches the signals from the first wait on.
    ///
    /// # Errors
    /// None on this system.
    #[cfg(not(unix))]
    pub fn listen() -> io::Result<Self> {
        Ok(Self {})
    }

    /// Waits for a signal and returns its name.
    ///
    /// # Errors
    /// If the system does not let the program catch it.
    #[cfg(unix)]
    async fn recv(&mut self) -> io::Result<&'static str> {
        let Self { interrupt, terminate, hangup } = self;
        let hung_up = async {
            match hangup {
                Some(hangup) => hangup.recv().await,
                None => std::future::pending().await,
            }
        };
        Ok(tokio::select! {
            _ = interrupt.recv() => "SIGINT",
            _ = terminate.recv() => "SIGTERM",
            _ = hung_up => HANGUP,
        })
    }

    /// Waits for Ctrl-C and returns its name.
    ///
    /// # Errors
    /// If the system does not let the program catch it.
    #[cfg(not(unix))]
    async fn recv(&mut self) -> io::Result<&'static str> {
        tokio::signal::ctrl_c().await?;
        Ok("Ctrl-C")
    }

    /// Waits for a signal and returns its name. A second signal, from then on, ends the process at once: whoever
    /// asks twice does not want to wait for an orderly end. A terminal that closes asks once, however often it says so.
    ///
    /// # Errors
    /// If the system does not let the program catch them.
    pub async fn first(mut self) -> io::Result<&'static str> {
        let name = self.recv().await?;
        tokio::spawn(async move {
            while let Ok(name) = self.recv().await {
                if name != HANGUP {
                    std::process::exit(INTERRUPTED);
                }
            }
        });
        Ok(name)
    }
}

/// Whether a process ignores a signal, by its status as Linux tells it.
#[cfg(unix)]
fn is_ignored(status: &str, signal: i32) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    // A bit for each signal from 1 on.
    mask.is_some_and(|mask| (mask >> (signal - 1)) & 1 == 1)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_signal_is_ignored_if_its_bit_in_the_status_is_set() {
        let status =
            "Name:\tnappe\nSigBlk:\t0000000000000002\nSigIgn:\t0000000000001001\nSigCgt:\t0000000000000002\n";
        let ignored: Vec<i32> = (1..=64).filter(|signal| is_ignored(status, *signal)).collect();
        assert_eq!(ignored, [1, 13]);
        for nothing in ["", "SigIgn:\n", "SigIgn:\tmany\n"] {
            assert!(!is_ignored(nothing, 1), "{nothing}");
        }
    }
}

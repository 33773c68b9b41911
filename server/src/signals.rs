//! The signals that ask a program to end: SIGINT (Ctrl-C) and SIGTERM. The first asks, the second ends it.

use std::io;

/// Exit code of a program that a second signal ended.
const INTERRUPTED: i32 = 130;

/// Signals, caught from the moment that this is made: make it before telling anybody the address.
#[derive(Debug)]
pub struct Signals {
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
}

impl Signals {
    /// Catches the signals from now on.
    ///
    /// # Errors
    /// If the system does not let the program catch them.
    #[cfg(unix)]
    pub fn listen() -> io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        Ok(Self { interrupt: signal(SignalKind::interrupt())?, terminate: signal(SignalKind::terminate())? })
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
        Ok(tokio::select! {
            _ = self.interrupt.recv() => "SIGINT",
            _ = self.terminate.recv() => "SIGTERM",
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
    /// asks twice does not want to wait for an orderly end.
    ///
    /// # Errors
    /// If the system does not let the program catch them.
    pub async fn first(mut self) -> io::Result<&'static str> {
        let name = self.recv().await?;
        tokio::spawn(async move {
            if self.recv().await.is_ok() {
                std::process::exit(INTERRUPTED);
            }
        });
        Ok(name)
    }
}

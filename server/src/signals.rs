//! The signals that ask a program to end: SIGINT (Ctrl-C) and SIGTERM. The first asks, the second ends it. SIGXFSZ does not.

use std::io;

/// Exit code of a program that a second signal ended.
const INTERRUPTED: i32 = 130;

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

//! The signals that ask a program to end: SIGINT (Ctrl-C) and SIGTERM.

use std::io;

/// Waits for a signal and returns its name. A second signal is not caught: it ends the program
/// once the caller drops its interest.
///
/// # Errors
/// If the system does not let the program listen for signals.
#[cfg(unix)]
pub async fn shutdown_signal() -> io::Result<&'static str> {
    use tokio::signal::unix::{SignalKind, signal};
    let (mut interrupt, mut terminate) = (signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?);
    Ok(tokio::select! {
        _ = interrupt.recv() => "SIGINT",
        _ = terminate.recv() => "SIGTERM",
    })
}

/// Waits for Ctrl-C and returns its name.
///
/// # Errors
/// If the system does not let the program listen for it.
#[cfg(not(unix))]
pub async fn shutdown_signal() -> io::Result<&'static str> {
    tokio::signal::ctrl_c().await?;
    Ok("Ctrl-C")
}

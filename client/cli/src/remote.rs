//! Talking to a server: the runtime, the connection, signals, and errors in the command's words.

use std::future::Future;

use nappe_client::{Client, ClientError};

use crate::{
    args::ServerArgs,
    error::{CliError, Exit, Result},
};

/// Runs asynchronous work to its end on a runtime of its own.
///
/// # Errors
/// The work's, or when the system refuses threads.
pub(crate) fn block_on<T>(work: impl Future<Output = Result<T>>) -> Result<T> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .map_err(|error| CliError::failure(format!("cannot start the runtime: {error}")))?;
    let answer = runtime.block_on(work);
    // Tasks that still wait for a connection must not keep the command from ending.
    runtime.shutdown_background();
    answer
}

/// Connects.
///
/// # Errors
/// When nothing answers.
pub(crate) async fn connect(args: &ServerArgs) -> Result<Client> {
    Client::connect(&args.server).await.map_err(CliError::from)
}

/// Waits for Ctrl-C or SIGTERM. After the first, a second one ends the process at once.
///
/// # Errors
/// When the system refuses the handlers.
pub(crate) async fn interrupted() -> Result<()> {
    first_signal().await?;
    tokio::spawn(async {
        if first_signal().await.is_ok() {
            std::process::exit(Exit::Interrupted as i32);
        }
    });
    Ok(())
}

async fn first_signal() -> Result<()> {
    let refused = |error| CliError::failure(format!("cannot listen to signals: {error}"));
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        let mut terminate = signal(SignalKind::terminate()).map_err(refused)?;
        let mut interrupt = signal(SignalKind::interrupt()).map_err(refused)?;
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
        Ok(())
    }
    #[cfg(not(unix))]
    tokio::signal::ctrl_c().await.map_err(refused)
}

impl From<ClientError> for CliError {
    fn from(error: ClientError) -> Self {
        let exit = match &error {
            ClientError::Address { .. } => Exit::Usage,
            ClientError::Connect { .. } | ClientError::Transport { .. } | ClientError::Deadline { .. } => {
                Exit::Unreachable
            }
            ClientError::Server(_) => Exit::Refused,
            _ => Exit::Failure,
        };
        let hint = match &error {
            ClientError::Connect { .. } => {
                Some("start one with `nappe serve`, or name another with --server URL or NAPPE_SERVER")
            }
            _ => match error.reason() {
                Some("SESSION_NOT_FOUND") => Some("`nappe list` shows the sessions of the server"),
                Some("SCENE_NOT_FOUND") => Some("`nappe scenes` lists the scenes that come with nappe"),
                _ => None,
            },
        };
        let error = Self::new(exit, error);
        match hint {
            Some(hint) => error.hint(hint),
            None => error,
        }
    }
}

//! Talking to a server: the runtime, the connection, signals, and errors in the command's words.

use std::{future::Future, time::Duration};

use nappe_client::{Client, ClientError, Reason, Token};
use nappe_server::Signals;

use crate::{
    options::args::{ServerArgs, TokenArgs},
    words::{
        error::{CliError, Exit, Result},
        output,
    },
};

/// How long a call may take before the user is told that it waits.
const PATIENCE: Duration = Duration::from_secs(2);

/// Runs asynchronous work to its end on a runtime of its own.
///
/// # Errors
/// The work's, or when the system refuses threads.
pub(crate) fn block_on<T>(work: impl Future<Output = Result<T>>) -> Result<T> {
    let runtime = nappe_server::runtime()
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
    connect_to(&args.server, &args.token).await
}

/// Connects to a server at an address.
///
/// # Errors
/// When nothing answers, or the token's file cannot be read.
pub(crate) async fn connect_to(server: &str, token: &TokenArgs) -> Result<Client> {
    let client = match &token.file {
        None => Client::connect(server).await,
        Some(path) => Client::connect_with(server, &Token::read(path).map_err(CliError::failure)?).await,
    };
    client.map_err(CliError::from)
}

/// Waits for Ctrl-C, SIGTERM, or the end of the terminal. After the first, a second Ctrl-C or SIGTERM ends the process at
/// once.
///
/// # Errors
/// When the system refuses the handlers.
pub(crate) async fn interrupted() -> Result<()> {
    interrupted_by(catch_signals()?).await
}

/// Catches the signals from now on: before somebody is told that the program runs.
pub(crate) fn catch_signals() -> Result<Signals> {
    Signals::listen().map_err(|error| refused(&error))
}

/// As [`interrupted`], with signals that are caught already.
pub(crate) async fn interrupted_by(signals: Signals) -> Result<()> {
    signals.first().await.map_err(|error| refused(&error))?;
    Ok(())
}

/// Waits for an answer, and tells the user when it takes a while: a call may have to wait for the step in
/// progress, or for steps that it asked for, and a server that is gone is noticed by the connection itself.
pub(crate) async fn answer<T>(
    session_id: &str,
    call: impl Future<Output = std::result::Result<T, ClientError>>,
) -> Result<T> {
    let mut call = std::pin::pin!(call);
    if let Ok(answer) = tokio::time::timeout(PATIENCE, call.as_mut()).await {
        return answer.map_err(CliError::from);
    }
    output::note(&format!(
        "nappe: session {session_id} is still stepping; waiting for it, Ctrl-C ends the wait"
    ));
    call.await.map_err(CliError::from)
}

/// What is said of a stream whose connection broke.
pub(crate) fn broke(client: &Client, cause: &str) -> String {
    format!("the stream of {} broke, and is asked for again: {cause}", client.endpoint())
}

/// What is said of a stream whose connection is back.
pub(crate) fn back(attempts: u32, cause: &str) -> String {
    format!("the connection broke ({cause}) and is back after {attempts} attempts")
}

fn refused(error: &std::io::Error) -> CliError {
    CliError::failure(format!("cannot listen to signals: {error}"))
}

impl From<ClientError> for CliError {
    fn from(error: ClientError) -> Self {
        let exit = Exit::from(&error);
        let hint = match &error {
            ClientError::Connect { .. } => {
                Some("start one with `nappe serve`, or name another with --server URL or NAPPE_SERVER")
            }
            _ => error.known_reason().and_then(remedy),
        };
        let error = Self::new(exit, error);
        match hint {
            Some(hint) => error.hint(hint),
            None => error,
        }
    }
}

/// What to do about a refusal, from the contract's table of reasons.
pub(crate) fn remedy(reason: Reason) -> Option<&'static str> {
    match reason {
        Reason::SessionNotFound => Some("`nappe list` shows the sessions of the server"),
        Reason::SceneNotFound => Some("`nappe scenes` lists the scenes that come with nappe"),
        // The message says where in the scene, and what is allowed there.
        Reason::InvalidScene | Reason::InvalidField => None,
        reason => Some(reason.remedy()),
    }
}

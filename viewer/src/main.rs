//! The display program: watches a session on a server, or all of them, and shows them in Rerun.
//!
//! Enters: a server's address and a session's id. Leaves: a Rerun viewer that shows it, or a recording file. A thin
//! shell over `nappe_rerun::show`, for people and for the command `nappe`, which starts it with `--json`.

mod tell;
mod arguments;
mod input;
mod server;
mod follow;

use std::{num::NonZeroUsize, process::ExitCode, thread};

use clap::Parser as _;
use nappe_client::{Event, Token};
use nappe_rerun::{Shown, show};
use tokio::runtime::{Builder, Runtime};

use crate::{
    arguments::Arguments,
    input::Input,
    server::Server,
    tell::{Audience, Failure},
};

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(answer) => return tell::answered(&answer),
    };
    let audience = arguments.audience();
    let failure = match runtime().and_then(|runtime| runtime.block_on(run(&arguments, audience))) {
        Ok(()) => return ExitCode::SUCCESS,
        Err(failure) => failure,
    };
    audience.failed(&failure);
    ExitCode::from(failure.exit as u8)
}

/// A worker per logical core; `TOKIO_WORKER_THREADS` changes nothing.
fn runtime() -> Result<Runtime, Failure> {
    let workers = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let runtime = Builder::new_multi_thread().worker_threads(workers).enable_all().build();
    runtime.map_err(|error| Failure::new(format!("cannot start the runtime: {error}")))
}

async fn run(arguments: &Arguments, audience: Audience) -> Result<(), Failure> {
    input::outlive_file_limits()
        .map_err(|error| Failure::new(format!("cannot listen to signals: {error}")))?;
    let mut input = Input::read(arguments)?;
    let token = match &arguments.token {
        None => None,
        Some(_) if arguments.reads_token() => Some(input.token().await?),
        Some(path) => Some(Token::read(path).map_err(Failure::new)?),
    };
    let server = Server { address: arguments.server.clone(), token };
    let stop = input.end();

    let Some(session_id) = &arguments.session else {
        let followed = follow::follow(&server, arguments.sink(), audience);
        tokio::select! {
            never = followed => match never {},
            () = stop => return Ok(()),
        }
    };
    let client = server.connect().await?;
    let oldest_frame = client.get_session(session_id).await?.oldest_frame;
    let options = arguments.options(oldest_frame);
    let tell = |event: &Event| audience.event(session_id, event);
    let shown = show(&client, session_id, arguments.sink(), options, stop, tell).await?;
    if arguments.paced {
        check_complete(&shown)?;
    }
    audience.shown(session_id, &shown, arguments.save.as_deref());
    Ok(())
}

/// A session that finished gave every frame from its first, 0, to its last.
fn check_complete(shown: &Shown) -> Result<(), Failure> {
    let Some(end) = shown.end else { return Ok(()) };
    let made = end.frame + 1;
    if shown.frame_count == made {
        return Ok(());
    }
    let frames = shown.frame_count;
    Err(Failure::new(format!("{frames} frames came of {made}: the recording is not complete")))
}

#[cfg(test)]
mod tests {
    use nappe_client::{Exit, SessionEnd};

    use super::*;

    #[test]
    fn a_frame_that_is_missing_at_the_end_is_a_failure() {
        let shown = |frame_count, end| Shown { frame_count, end, ..Shown::default() };
        let end = Some(SessionEnd { frame: 20, step: 40, state_hash: 1 });
        assert!(check_complete(&shown(21, end)).is_ok() && check_complete(&shown(3, None)).is_ok());
        let failure = check_complete(&shown(20, end)).expect_err("one is missing");
        assert_eq!(
            (failure.exit, failure.to_string().contains("20 frames came of 21")),
            (Exit::Failure, true)
        );
    }
}

//! `nappe pause`: stops a session's stepping, after the step in progress.

use clap::Args;

use crate::{args::SessionArgs, error::Result, remote, session as words};

/// Stop a session's stepping for a while
#[derive(Args, Debug)]
pub(crate) struct PauseArgs {
    #[command(flatten)]
    session: SessionArgs,
}

/// Runs `nappe pause`.
///
/// # Errors
/// When there is no such session or no server.
pub(crate) fn run(args: &PauseArgs) -> Result<()> {
    let SessionArgs { id, server, output } = &args.session;
    remote::block_on(async {
        let client = remote::connect(server).await?;
        let session = remote::answer(id, client.pause(id)).await?;
        words::print(&session, output.format())
    })
}

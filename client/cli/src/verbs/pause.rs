//! `nappe pause`: stops a session's stepping, after the step in progress.

use clap::Args;
use nappe_client::{Paused, Wait};

use crate::{
    options::args::SessionArgs,
    outside::remote,
    words::{
        error::Result,
        output::{self, Format},
        session as words,
    },
};

/// Stop a session's stepping for a while
#[derive(Args, Debug)]
pub(crate) struct PauseArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// Answer at once, even if a step is in progress
    #[arg(long)]
    no_wait: bool,
}

/// Runs `nappe pause`.
///
/// # Errors
/// When there is no such session or no server.
pub(crate) fn run(args: &PauseArgs) -> Result<()> {
    let SessionArgs { id, server, output } = &args.session;
    let wait = if args.no_wait { Wait::No } else { Wait::Yes };
    remote::block_on(async {
        let client = remote::connect(server).await?;
        let Paused { session, effective_step } = remote::answer(id, client.pause(id, wait)).await?;
        words::print(&session, output.format())?;
        if output.format() == Format::Text && effective_step > session.step {
            output::line(&format!("a step is in progress: it will stand after step {effective_step}"))?;
        }
        Ok(())
    })
}

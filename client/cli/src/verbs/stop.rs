//! `nappe stop`: ends a session's simulation; the session stays readable until it is deleted.

use clap::Args;

use crate::{
    options::args::SessionArgs,
    outside::remote,
    words::{error::Result, session as words},
};

/// End a session's simulation; the session stays readable
#[derive(Args, Debug)]
pub(crate) struct StopArgs {
    #[command(flatten)]
    session: SessionArgs,
}

/// Runs `nappe stop`.
///
/// # Errors
/// When there is no such session or no server.
pub(crate) fn run(args: &StopArgs) -> Result<()> {
    let SessionArgs { id, server, output } = &args.session;
    remote::block_on(async {
        let client = remote::connect(server).await?;
        let session = remote::answer(id, client.stop(id)).await?;
        words::print(&session, output.format())
    })
}

//! `nappe pause`: stops a session's stepping, after the step in progress.

use crate::{args::SessionArgs, error::Result, remote, session as words};

/// Runs `nappe pause`.
///
/// # Errors
/// When there is no such session or no server.
pub(crate) fn run(args: &SessionArgs) -> Result<()> {
    remote::block_on(async {
        let client = remote::connect(&args.server).await?;
        let session = client.pause(&args.session).await?;
        words::print(&session, args.output.format())
    })
}

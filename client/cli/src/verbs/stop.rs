//! `nappe stop`: ends a session's simulation; the session stays readable until it is deleted.

use crate::{args::SessionArgs, error::Result, remote, session as words};

/// Runs `nappe stop`.
///
/// # Errors
/// When there is no such session or no server.
pub(crate) fn run(args: &SessionArgs) -> Result<()> {
    remote::block_on(async {
        let client = remote::connect(&args.server).await?;
        let session = client.stop(&args.session).await?;
        words::print(&session, args.output.format())
    })
}

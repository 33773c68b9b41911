//! `nappe delete`: ends a session and forgets it.

use clap::Args;
use serde_json::json;

use crate::{
    options::args::SessionArgs,
    outside::remote,
    words::{
        error::Result,
        output::{self, Format},
    },
};

/// End a session and forget it
#[derive(Args, Debug)]
pub(crate) struct DeleteArgs {
    #[command(flatten)]
    session: SessionArgs,
}

/// Runs `nappe delete`.
///
/// # Errors
/// When there is no such session or no server.
pub(crate) fn run(args: &DeleteArgs) -> Result<()> {
    let SessionArgs { id, server, output } = &args.session;
    remote::block_on(async {
        let client = remote::connect(server).await?;
        remote::answer(id, client.delete_session(id)).await?;
        match output.format() {
            Format::Json => output::json(&json!({ "deleted": id })),
            Format::Text => output::line(&format!("deleted {id}")),
        }
    })
}

//! `nappe reset`: puts a session back to its start.

use clap::Args;
use nappe_client::v1;
use serde_json::json;

use crate::{
    options::args::SessionArgs,
    outside::remote,
    words::{
        error::Result,
        output::{self, Format},
    },
};

/// Put a session back to its start; its steps, time and frames go on
#[derive(Args, Debug)]
pub(crate) struct ResetArgs {
    #[command(flatten)]
    session: SessionArgs,
}

/// Runs `nappe reset`.
///
/// # Errors
/// When the session has ended, or there is no such session or no server.
pub(crate) fn run(args: &ResetArgs) -> Result<()> {
    let SessionArgs { id, server, output } = &args.session;
    remote::block_on(async {
        let client = remote::connect(server).await?;
        let reset = remote::answer(id, client.reset(id)).await?;
        let v1::ResetSessionResponse { effective_step, order } = reset;
        match output.format() {
            Format::Json => {
                output::json(&json!({ "session_id": id, "effective_step": effective_step, "order": order }))
            }
            Format::Text => output::line(&format!("{id}: as at its start, before step {effective_step}")),
        }
    })
}

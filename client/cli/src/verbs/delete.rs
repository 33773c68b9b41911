//! `nappe delete`: ends a session and forgets it.

use serde_json::json;

use crate::{
    args::SessionArgs,
    error::Result,
    output::{self, Format},
    remote,
};

/// Runs `nappe delete`.
///
/// # Errors
/// When there is no such session or no server.
pub(crate) fn run(args: &SessionArgs) -> Result<()> {
    remote::block_on(async {
        let client = remote::connect(&args.server).await?;
        client.delete_session(&args.session).await?;
        match args.output.format() {
            Format::Json => output::json(&json!({ "deleted": args.session })),
            Format::Text => output::line(&format!("deleted {}", args.session)),
        }
    })
}

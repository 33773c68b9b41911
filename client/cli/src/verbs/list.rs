//! `nappe list`: the sessions of a server.

use clap::Args;

use crate::{
    options::args::ServerArgs,
    outside::remote,
    words::{
        error::Result,
        output::{self, Format, OutputArgs},
        session,
    },
};

/// List the sessions of a server
#[derive(Args, Debug)]
pub(crate) struct ListArgs {
    #[command(flatten)]
    server: ServerArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe list`.
///
/// # Errors
/// When there is no server.
pub(crate) fn run(args: &ListArgs) -> Result<()> {
    remote::block_on(async {
        let client = remote::connect(&args.server).await?;
        let sessions = client.list_sessions().await?;
        match args.output.format() {
            Format::Json => output::json(&sessions),
            Format::Text if sessions.is_empty() => output::line(&format!(
                "{} has no sessions; `nappe create SCENE` makes one",
                client.endpoint()
            )),
            Format::Text => output::line(&session::text(&sessions)),
        }
    })
}

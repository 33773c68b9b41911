//! `nappe step`: takes a number of steps and waits for them.

use clap::Args;
use nappe_client::Wait;

use crate::{args::ServerArgs, error::Result, output::OutputArgs, remote, session as words};

/// Options of `nappe step`.
#[derive(Args, Debug)]
pub(crate) struct StepArgs {
    /// Id of the session, as `nappe list` shows it
    session: String,
    /// How many steps
    #[arg(value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    count: u64,
    /// Answer at once instead of waiting until the steps are taken
    #[arg(long)]
    no_wait: bool,
    #[command(flatten)]
    server: ServerArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe step`.
///
/// # Errors
/// When a step fails, or there is no such session or no server.
pub(crate) fn run(args: &StepArgs) -> Result<()> {
    remote::block_on(async {
        let client = remote::connect(&args.server).await?;
        let wait = if args.no_wait { Wait::No } else { Wait::Yes };
        let session = client.step(&args.session, args.count, wait).await?;
        words::print(&session, args.output.format())
    })
}

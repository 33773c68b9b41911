//! `nappe step`: takes a number of steps and waits for them.

use clap::Args;
use nappe_client::Wait;
use nappe_server::numbers::whole;

use crate::{
    options::args::SessionArgs,
    outside::remote,
    words::{error::Result, session as words},
};

/// Take a number of steps
#[derive(Args, Debug)]
pub(crate) struct StepArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// Number of steps
    #[arg(value_name = "N", default_value_t = 1, value_parser = whole::<u64>(1..))]
    count: u64,
    /// Take the steps that are left until STEP are taken since the start: a call that can be repeated
    #[arg(long, value_name = "STEP", conflicts_with = "count", value_parser = whole::<u64>(0..))]
    to: Option<u64>,
    /// Answer at once instead of waiting until the steps are taken
    #[arg(long)]
    no_wait: bool,
}

/// Runs `nappe step`.
///
/// # Errors
/// When a step fails, or there is no such session or no server.
pub(crate) fn run(args: &StepArgs) -> Result<()> {
    let SessionArgs { id, server, output } = &args.session;
    let wait = if args.no_wait { Wait::No } else { Wait::Yes };
    remote::block_on(async {
        let client = remote::connect(server).await?;
        let session = match args.to {
            None => remote::answer(id, client.step(id, args.count, wait)).await?,
            Some(step) => remote::answer(id, client.step_to(id, step, wait)).await?,
        };
        words::print(&session, output.format())
    })
}

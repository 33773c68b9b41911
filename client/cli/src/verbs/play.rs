//! `nappe play`: lets a session step on, as fast as it can or at a pace.

use clap::Args;

use crate::{
    args::SessionArgs,
    error::{CliError, Result},
    remote, session as words,
};

/// Let a session step on
#[derive(Args, Debug)]
pub(crate) struct PlayArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// Simulated seconds per second of wall clock: 1 is real time; without it, as fast as possible
    #[arg(long, value_name = "FACTOR")]
    pace: Option<f64>,
}

/// Runs `nappe play`.
///
/// # Errors
/// When the pace is not above 0, or there is no such session or no server.
pub(crate) fn run(args: &PlayArgs) -> Result<()> {
    if let Some(pace) = args.pace.filter(|pace| !(pace.is_finite() && *pace > 0.0)) {
        return Err(CliError::usage(format!("--pace is {pace}: it is a number above 0"))
            .hint("1 is real time; leave --pace out to go as fast as possible"));
    }
    let SessionArgs { id, server, output } = &args.session;
    remote::block_on(async {
        let client = remote::connect(server).await?;
        let session = remote::answer(id, client.play(id, args.pace.unwrap_or(0.0))).await?;
        words::print(&session, output.format())
    })
}

//! `nappe play`: lets a session step on, as fast as it can or at a multiple of real time.

use clap::Args;

use crate::{
    args::SessionArgs,
    error::{CliError, Result},
    output, remote, session as words,
};

/// Let a session step on
#[derive(Args, Debug)]
pub(crate) struct PlayArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// Simulated seconds per second of wall clock: 1 is real time; without it, as fast as possible
    #[arg(long, value_name = "FACTOR")]
    real_time_factor: Option<f64>,
    /// An old name of --real-time-factor
    #[arg(long, hide = true, conflicts_with = "real_time_factor")]
    pace: Option<f64>,
}

/// Runs `nappe play`.
///
/// # Errors
/// When the real-time factor is not above 0, or there is no such session or no server.
pub(crate) fn run(args: &PlayArgs) -> Result<()> {
    if args.pace.is_some() {
        output::note("warning: the option --pace is now called --real-time-factor");
    }
    let factor = args.real_time_factor.or(args.pace);
    if let Some(factor) = factor.filter(|factor| !(factor.is_finite() && *factor > 0.0)) {
        return Err(CliError::usage(format!("--real-time-factor is {factor}: it is a number above 0"))
            .hint("1 is real time; leave --real-time-factor out to go as fast as possible"));
    }

    let SessionArgs { id, server, output } = &args.session;
    remote::block_on(async {
        let client = remote::connect(server).await?;
        let session = remote::answer(id, client.play(id, factor.unwrap_or(0.0))).await?;
        words::print(&session, output.format())
    })
}

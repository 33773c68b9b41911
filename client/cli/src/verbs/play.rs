//! `nappe play`: lets a session step on, as fast as it can or at a multiple of real time.

use clap::Args;
use nappe_server::numbers::{Least, PLAIN, real};

use crate::{
    options::args::SessionArgs,
    outside::remote,
    words::{error::Result, output, session as words},
};

/// Let a session step on
#[derive(Args, Debug)]
pub(crate) struct PlayArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// Simulated seconds per second of wall clock: 1 is real time; without it, as fast as possible
    #[arg(long, value_name = "FACTOR", value_parser = real(PLAIN, Least::Above0))]
    real_time_factor: Option<f64>,
    /// An old name of --real-time-factor
    #[arg(long, hide = true, conflicts_with = "real_time_factor", value_parser = real(PLAIN, Least::Above0))]
    pace: Option<f64>,
}

/// Runs `nappe play`.
///
/// # Errors
/// When there is no such session or no server.
pub(crate) fn run(args: &PlayArgs) -> Result<()> {
    if args.pace.is_some() {
        output::note("warning: the option --pace is now called --real-time-factor");
    }
    let factor = args.real_time_factor.or(args.pace);
    let SessionArgs { id, server, output } = &args.session;
    remote::block_on(async {
        let client = remote::connect(server).await?;
        let session = remote::answer(id, client.play(id, factor.unwrap_or(0.0))).await?;
        words::print(&session, output.format())
    })
}

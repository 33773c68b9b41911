//! `nappe fork`: makes a session that stands where another one stands.

use clap::Args;
use nappe_server::numbers::whole;

use crate::{
    options::args::SessionArgs,
    outside::remote,
    words::{error::Result, session as words},
};

/// Copy a session as it stands, to go on with other parameters
///
/// The new session has the same step, the same bits and the same parameters; the other one goes on as it was.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe fork first --id calm          the same step, the same bits; first goes on as it was
  nappe update calm --wind 0,0,0      from there without wind
  nappe fork first --steps 500        to the 500th step since the start of first")]
pub(crate) struct ForkArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// Id of the new session [default: the server chooses]
    #[arg(long = "id", value_name = "NEW", default_value = "", hide_default_value = true)]
    new_id: String,
    /// Steps since the start of the other session until the new one ends; 0: never [default: as the other one, never
    /// if that one is at its end]
    #[arg(long, value_name = "N", value_parser = whole::<u64>(0..))]
    steps: Option<u64>,
}

/// Runs `nappe fork`.
///
/// # Errors
/// When there is no such session, it failed, the id is taken, or there is no server.
pub(crate) fn run(args: &ForkArgs) -> Result<()> {
    let SessionArgs { id, server, output } = &args.session;
    remote::block_on(async {
        let session = remote::connect(server).await?.fork(id, &args.new_id, args.steps).await?;
        words::print(&session, output.format())
    })
}

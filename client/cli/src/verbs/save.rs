//! `nappe save`: keeps a session as a file.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use crate::{
    files::write::{self, ForceArgs},
    options::args::SessionArgs,
    outside::remote,
    words::{
        error::Result,
        output::{self, Format},
    },
};

/// Keep a session as a file, to go on from it later or elsewhere
///
/// The file holds the session as it stands between two steps, with its scene, its meshes and the changes that wait; the session goes on.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe save first first.session            as it stands now
  nappe create --from first.session         on this or another server: the same step, the same bits")]
pub(crate) struct SaveArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// The file that keeps the session
    #[arg(value_name = "FILE")]
    path: PathBuf,
    #[command(flatten)]
    force: ForceArgs,
}

/// Runs `nappe save`.
///
/// # Errors
/// When there is no such session, it failed, the file cannot be written, or there is no server.
pub(crate) fn run(args: &SaveArgs) -> Result<()> {
    let SessionArgs { id, server, output } = &args.session;
    let (path, existing) = (&args.path, args.force.existing());
    write::check(path, existing)?;
    remote::block_on(async {
        let client = remote::connect(server).await?;
        let file = remote::answer(id, client.save(id)).await?.whole().await?;
        write::write_whole(path, &file, existing)?;
        match output.format() {
            Format::Json => output::json(&json!({ "saved": path, "session_id": id, "bytes": file.len() })),
            Format::Text => {
                output::line(&format!("session {id} is in {}, {} bytes", path.display(), file.len()))
            }
        }
    })
}

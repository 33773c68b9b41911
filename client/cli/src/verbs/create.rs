//! `nappe create`: makes a session on a server, paused at its start, or where one was saved.

use std::{
    fs,
    path::{Path, PathBuf},
};

use clap::Args;
use nappe_server::state::newest_state;

use crate::{
    options::args::{OverrideArgs, ServerArgs},
    outside::remote,
    scenes::{saved, scene},
    words::{
        error::{CliError, Result},
        output::OutputArgs,
        session as words,
    },
};

/// Make a session on a server
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe create flag --id first               paused before its first step
  nappe create --from first.session          paused where `nappe save` found it, with the same bits
  nappe create --from first.session --steps 500   to the 500th step since the start of its scene")]
pub(crate) struct CreateArgs {
    /// A scene that the server ships, or a scene file (.toml); meshes beside the file are uploaded
    #[arg(required_unless_present = "from")]
    scene: Option<String>,
    /// Go on from a session that `nappe save` kept, or from the newest state in a folder DIR/sessions/UID that a server with
    /// --state-dir DIR left, instead of a scene; what options leave open is as it was there
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    from: Option<PathBuf>,
    /// Id for the session: 1 to 63 letters (a-z, A-Z), digits and '-', which is not the first [default: the server chooses]
    #[arg(long, value_name = "ID")]
    id: Option<String>,
    #[command(flatten)]
    overrides: OverrideArgs,
    #[command(flatten)]
    server: ServerArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe create`.
///
/// # Errors
/// When the scene or the file cannot be read or is refused, or there is no server.
pub(crate) fn run(args: &CreateArgs) -> Result<()> {
    let id = args.id.clone().unwrap_or_default();
    if let Some(path) = &args.from {
        let file = read(path)?;
        return remote::block_on(async {
            let client = remote::connect(&args.server).await?;
            let session = saved::go_on(&client, file, id, &args.overrides).await?;
            words::print(&session, args.output.format())
        });
    }
    let Some(scene) = &args.scene else {
        return Err(CliError::usage("a scene is needed, or --from FILE"));
    };
    let scene = scene::Input::read(scene, scene::Names::Servers)?;
    remote::block_on(async {
        let client = remote::connect(&args.server).await?;
        let session = scene.create(&client, id, &args.overrides, None).await?;
        words::print(&session, args.output.format())
    })
}

/// The file of a session, or the newest state in the folder that a server keeps of one.
fn read(path: &Path) -> Result<Vec<u8>> {
    let read = if path.is_dir() { newest_state(path) } else { fs::read(path) };
    read.map_err(|error| CliError::file("read", path, &error))
}

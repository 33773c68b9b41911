//! `nappe create`: makes a session on a server, paused at its start.

use clap::Args;

use crate::{
    args::{OverrideArgs, ServerArgs},
    error::Result,
    output::OutputArgs,
    remote, scene, session as words,
};

/// Make a session on a server
#[derive(Args, Debug)]
pub(crate) struct CreateArgs {
    /// A scene that the server ships, or a scene file (.toml); meshes beside the file are uploaded
    scene: String,
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
/// When the scene cannot be read or is refused, or there is no server.
pub(crate) fn run(args: &CreateArgs) -> Result<()> {
    let scene = scene::Input::read(&args.scene, scene::Names::Servers)?;
    remote::block_on(async {
        let client = remote::connect(&args.server).await?;
        let id = args.id.clone().unwrap_or_default();
        let session = scene.create(&client, id, &args.overrides, None).await?;
        words::print(&session, args.output.format())
    })
}

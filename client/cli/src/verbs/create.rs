//! `nappe create`: makes a session on a server, paused at its start.

use clap::Args;
use nappe_client::CreateSession;

use crate::{
    args::{PrecisionName, ServerArgs},
    error::Result,
    meshes,
    output::OutputArgs,
    remote, scene, session as words,
};

/// Options of `nappe create`.
#[derive(Args, Debug)]
pub(crate) struct CreateArgs {
    /// A scene that the server ships, or a scene file (.toml); meshes beside the file are uploaded
    scene: String,
    /// Id for the session: 4 to 63 of a-z, 0-9 and '-', starting with a letter [default: the server chooses]
    #[arg(long, value_name = "ID")]
    id: Option<String>,
    /// Ends by itself after so many steps [default: as the scene says]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    steps: Option<u64>,
    /// Threads [default: all cores of the server]; results do not depend on them
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..))]
    threads: Option<u32>,
    /// Precision of positions and velocities [default: as the scene says]
    #[arg(long, value_enum)]
    precision: Option<PrecisionName>,
    /// A frame every so many steps [default: as the scene says]
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..))]
    frame_every: Option<u32>,
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
        let created = client
            .create_session(CreateSession {
                session_id: args.id.clone().unwrap_or_default(),
                scene: scene.send(&client).await?,
                precision: args.precision.map(Into::into),
                thread_count: args.threads.unwrap_or(0),
                step_limit: args.steps.unwrap_or(0),
                frame_interval_steps: args.frame_every.unwrap_or(0),
            })
            .await?;
        meshes::note(&created.remarks);
        words::print(&created.session, args.output.format())
    })
}

//! `nappe` alone: a cloth falls over a sphere, in one command, on any machine.
//!
//! A server inside this command computes, its frames are read through gRPC and kept, and a table says what ran, how
//! fast, and how to look at it. It ends by itself and needs no screen.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::{
    args::ComputeArgs,
    compute::{self, Server},
    error::Result,
    output::{self, Format, OutputArgs},
    paths, remote,
    scene::{Input, Names},
    viewer::{BUILD, Viewer},
};

/// The scene shown.
const SCENE: &str = "demo";
/// The recording, in the current folder.
const RECORDING: &str = "nappe-demo.rrd";
/// The folder of PLY files where nothing records, in the current folder.
const FOLDER: &str = "nappe-demo";

/// Show what nappe does: the same as `nappe` alone
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct DemoArgs {
    #[command(flatten)]
    compute: ComputeArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs the demo.
///
/// # Errors
/// When it cannot be computed or recorded, or the user ends it.
pub(crate) fn run(args: &DemoArgs) -> Result<()> {
    let scene = Input::read(SCENE, Names::Ours)?;
    let format = args.output.format();
    remote::block_on(async {
        let mut compute = args.compute.clone();
        let saved = match compute.save {
            Some(path) => path,
            None => place().await?,
        };
        compute.save = Some(saved.clone());
        if format == Format::Text {
            output::line(&format!("nappe {}: a cloth falls over a sphere\n", env!("CARGO_PKG_VERSION")))?;
        }
        compute::compute(&scene, &compute, Server::Embedded, format).await?;
        match format {
            Format::Json => Ok(()),
            Format::Text => output::line(&what_next(&saved)),
        }
    })
}

/// Where the frames go: a recording if there is a viewer, which makes it, or else a folder that is not there yet.
async fn place() -> Result<PathBuf> {
    if Viewer::look().await?.is_some() {
        return Ok(PathBuf::from(RECORDING));
    }
    let names = (2..).map(|number| format!("{FOLDER}-{number}"));
    let mut paths = std::iter::once(FOLDER.to_owned()).chain(names).map(PathBuf::from);
    Ok(paths.find(|path| !path.exists()).unwrap_or_else(|| FOLDER.into()))
}

fn what_next(saved: &Path) -> String {
    let place = saved.display();
    if paths::is_recording(saved) {
        return format!(
            "\nTo look at it: rerun {place}\n(the viewer: `cargo install rerun-cli --locked --version 0.36.3` or `pip install rerun-sdk==0.36.3`)"
        );
    }
    format!(
        "\n{place} holds one PLY mesh per frame, which Blender and ParaView open.\nFor a Rerun recording: `{BUILD}`, then `cargo nappe` again."
    )
}

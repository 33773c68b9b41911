//! `nappe` alone: a cloth falls over a sphere, in one command, on any machine.
//!
//! A server inside this command computes, a client reads its frames through gRPC and records
//! them, and a table says what ran, how fast, and how to look at it. It ends by itself and needs
//! no screen.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::{
    args::ComputeArgs,
    compute::{self, Server},
    error::Result,
    output::{self, Format, OutputArgs},
    paths, remote, save,
    scene::{Input, Names},
};

/// The scene shown.
const SCENE: &str = "demo";
/// The recording, in the current folder.
const RECORDING: &str = "nappe-demo.rrd";

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
    let mut compute = args.compute.clone();
    if compute.save.is_none() && save::RECORDS {
        compute.save = Some(PathBuf::from(RECORDING));
    }

    let format = args.output.format();
    if format == Format::Text {
        output::line(&format!("nappe {}: a cloth falls over a sphere\n", env!("CARGO_PKG_VERSION")))?;
    }

    remote::block_on(compute::compute(&scene, &compute, Server::Embedded, format))?;
    match format {
        Format::Json => Ok(()),
        Format::Text => output::line(&what_next(compute.save.as_deref())),
    }
}

fn what_next(saved: Option<&Path>) -> String {
    match saved {
        Some(path) if paths::is_recording(path) => format!(
            "\nTo look at it: rerun {}\n(the viewer: `cargo install rerun-cli --locked --version 0.36.3` or `pip install rerun-sdk==0.36.3`)",
            path.display()
        ),
        Some(path) => format!("\n{} holds one PLY mesh per frame.", path.display()),
        None => "\nThis build has no Rerun (feature `rerun`), so nothing was recorded; --save FOLDER keeps PLY meshes."
            .to_owned(),
    }
}

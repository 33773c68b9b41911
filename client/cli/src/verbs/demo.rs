//! `nappe` alone: a cloth falls over a sphere, in one command, on any machine.
//!
//! A server inside this command computes, its frames are read through gRPC and kept, and a table says what ran, how
//! fast, and how to look at it. It ends by itself and needs no screen.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::{
    compute::{self, Server},
    files::{paths, write::ForceArgs},
    options::args::{ComputeArgs, JobArgs},
    outside::remote,
    scenes::scene::{Input, Names},
    words::{
        error::Result,
        output::{self, Format, OutputArgs},
    },
};

/// The scene shown.
const SCENE: &str = "demo";
/// The page, in the current folder.
const PAGE: &str = "nappe-demo.html";

/// Show what nappe does: the same as `nappe` alone
///
/// A server inside this command computes how a cloth falls over a sphere, a client reads it through gRPC and keeps a
/// page to look at. It ends by itself and needs no screen.
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
/// When it cannot be computed or saved, or the user ends it.
pub(crate) fn run(args: &DemoArgs) -> Result<()> {
    let scene = Input::read(SCENE, Names::Ours)?;
    let mut compute = args.compute.clone();
    let kept = [&compute.save, &compute.resume, &compute.table].into_iter().flatten().next().cloned();
    let saved = kept.unwrap_or_else(|| {
        // The name is the demo's own: what is there is the page of an earlier one.
        (compute.force, compute.save) = (ForceArgs::GIVEN, Some(PathBuf::from(PAGE)));
        PathBuf::from(PAGE)
    });

    let format = args.output.format();
    if format == Format::Text {
        output::line(&format!("nappe {}: a cloth falls over a sphere\n", env!("CARGO_PKG_VERSION")))?;
    }

    let job = JobArgs::default();
    remote::block_on(compute::compute(&scene, &compute, &job, Server::Embedded, format))?;
    match format {
        Format::Json => Ok(()),
        Format::Text => output::line(&what_next(&saved)),
    }
}

fn what_next(saved: &Path) -> String {
    let place = saved.display();
    if paths::is_html(saved) {
        format!("\nTo look at it: open {place} in a browser")
    } else if paths::is_recording(saved) {
        format!(
            "\nTo look at it: rerun {place}\n(the viewer: `cargo install rerun-cli --locked --version 0.36.3` or `pip install rerun-sdk==0.36.3`)"
        )
    } else if paths::is_vtk(saved) {
        format!("\nTo look at it: paraview {place}")
    } else if paths::is_usd(saved) {
        format!(
            "\nTo look at it: open {place} in Blender by File > Import > Universal Scene Description, or in usdview"
        )
    } else if paths::is_drawn(saved) {
        format!("\nTo look at it: open {place}")
    } else if paths::is_table(saved) {
        format!("\n{place} holds one row per frame.")
    } else {
        format!("\n{place} holds one PLY mesh per frame.")
    }
}

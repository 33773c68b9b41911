//! `nappe bench`: what this machine does, in figures that can be compared.

mod ball;
mod cloth;
mod paper;
mod race;
mod sample;
mod sheet;
mod snow;
mod stomakhin;
mod stream;
mod zara;

use clap::{Args, Subcommand};
use serde::Serialize;

use crate::error::Result;

/// Options of `nappe bench`.
#[derive(Args, Debug)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    suite: Suite,
}

#[derive(Subcommand, Debug)]
enum Suite {
    /// The table of Zara 2001: seconds of each stage and of a frame, beside the paper's figures
    Zara(zara::ZaraArgs),
    /// A 400 x 400 sheet with 956 002 springs: seconds a step, f32 and f64, one thread and all
    Cloth(cloth::ClothArgs),
    /// Frames a second from an embedded server to one client over loopback
    Stream(stream::StreamArgs),
    /// Snow of 200 000 and 1 000 000 particles: particle-steps a second, time per stage, memory
    Snow(snow::SnowArgs),
    /// A snowball of 300 000 particles: seconds a frame, beside the 5.2 minutes of Stomakhin et al. 2013
    Stomakhin(stomakhin::StomakhinArgs),
}

/// A measurement. These names are stable: scripts read them.
#[derive(Clone, Debug, Serialize)]
struct Row {
    name: String,
    particles: usize,
    threads: usize,
    precision: &'static str,
    median_seconds: f64,
    min_seconds: f64,
    rate: f64,
    unit: &'static str,
}

/// Runs `nappe bench`.
///
/// # Errors
/// When a run fails.
pub(crate) fn run(args: &BenchArgs) -> Result<()> {
    match &args.suite {
        Suite::Zara(args) => zara::run(args),
        Suite::Cloth(args) => cloth::run(args),
        Suite::Stream(args) => stream::run(args),
        Suite::Snow(args) => snow::run(args),
        Suite::Stomakhin(args) => stomakhin::run(args),
    }
}

/// One thread and all of them; one measurement on a machine with one core.
fn thread_counts(wanted: Option<u16>) -> Vec<usize> {
    let all = wanted.map_or_else(rayon::current_num_threads, usize::from);
    if all == 1 { vec![1] } else { vec![1, all] }
}

//! `nappe bench`: what this machine does, in figures that can be compared.

mod cloth;
mod paper;
mod race;
mod sample;
mod sheet;
mod stream;
mod zara;

use clap::{Args, Subcommand};
use serde::Serialize;

use crate::error::{CliError, Result};

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
    /// Snow; not there yet
    Snow(SnowArgs),
}

#[derive(Args, Debug)]
struct SnowArgs {
    #[command(flatten)]
    _output: crate::output::OutputArgs,
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
/// When a run fails, or for snow, which this version cannot simulate.
pub(crate) fn run(args: &BenchArgs) -> Result<()> {
    match &args.suite {
        Suite::Zara(args) => zara::run(args),
        Suite::Cloth(args) => cloth::run(args),
        Suite::Stream(args) => stream::run(args),
        Suite::Snow(_) => {
            Err(CliError::usage("nappe simulates cloth; snow is not there yet, so there is nothing to time")
                .hint("the benchmarks that exist: nappe bench zara, nappe bench cloth, nappe bench stream"))
        }
    }
}

/// One thread and all of them; one measurement on a machine with one core.
fn thread_counts(wanted: Option<u16>) -> Vec<usize> {
    let all = wanted.map_or_else(rayon::current_num_threads, usize::from);
    if all == 1 { vec![1] } else { vec![1, all] }
}

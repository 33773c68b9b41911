//! `nappe bench`: what this machine does, in numbers that can be compared.
//!
//! Each suite has a file; the files above them are shared.

mod isa;
mod row;
mod sample;
mod timings;
mod triad;
mod sheet;
mod ball;
mod paper;
mod cloud;
mod process;
mod loopback;
mod zara;
mod thick;
mod cloth;
mod solver;
mod stream;
mod packed;
mod snow;
mod stomakhin;
mod serve;

use clap::{Args, Subcommand};

use crate::words::error::Result;

/// Measure what this machine does
#[derive(Args, Debug)]
pub(crate) struct BenchArgs {
    /// Instructions of the kernels [default: the widest of this processor]
    #[arg(long, value_enum, global = true)]
    isa: Option<isa::Isa>,
    #[command(subcommand)]
    suite: Suite,
}

#[derive(Subcommand, Debug)]
enum Suite {
    Zara(zara::ZaraArgs),
    Cloth(cloth::ClothArgs),
    Solver(solver::SolverArgs),
    Stream(stream::StreamArgs),
    Packed(packed::PackedArgs),
    Snow(snow::SnowArgs),
    Stomakhin(stomakhin::StomakhinArgs),
    Serve(serve::ServeArgs),
}

/// Runs `nappe bench`.
///
/// # Errors
/// When a run fails, or the processor lacks the instructions that are asked for.
pub(crate) fn run(args: &BenchArgs) -> Result<()> {
    if let Some(isa) = args.isa {
        isa::use_from_now_on(isa)?;
    }
    match &args.suite {
        Suite::Zara(args) => zara::run(args),
        Suite::Cloth(args) => cloth::run(args),
        Suite::Solver(args) => solver::run(args),
        Suite::Stream(args) => stream::run(args),
        Suite::Packed(args) => packed::run(args),
        Suite::Snow(args) => snow::run(args),
        Suite::Stomakhin(args) => stomakhin::run(args),
        Suite::Serve(args) => serve::run(args),
    }
}

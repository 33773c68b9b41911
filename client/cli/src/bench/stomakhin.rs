//! `nappe bench stomakhin`: seconds per frame of a snowball, beside those of Stomakhin et al. 2013. They print a time
//! for one of this size.
//!
//! 300 000 particles on cells of 5 mm hit a wall above a floor. A frame is one step of the world, 1/24 s, divided
//! into steps of the snow as the certified bound asks.

use clap::Args;
use nappe_server::numbers::whole;
use nappe_sim::math::Precision;
use serde::Serialize;

use super::{
    ball::Throw,
    row::Row,
    sample,
    timings::{self, StepCounts},
};
use crate::{
    options::args::PrecisionName,
    words::{
        error::Result,
        output::{self, Column, Format, OutputArgs},
    },
};

/// Seconds per frame of 300 000 particles in Stomakhin et al. 2013: 5.2 minutes.
const PUBLISHED_SECONDS: f64 = 312.0;

/// A snowball of 300 000 particles: seconds per frame, beside the 5.2 minutes of Stomakhin et al. 2013
#[derive(Args, Debug)]
pub(crate) struct StomakhinArgs {
    /// Particles of the ball
    #[arg(long, value_name = "N", default_value_t = 300_000, value_parser = whole::<u32>(1_000..=20_000_000))]
    particles: u32,
    /// Frames computed, from the moment before the ball meets the wall
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = whole::<u32>(1..))]
    frames: u32,
    /// Threads [default: all cores]
    #[arg(long, value_name = "T", value_parser = whole::<u16>(1..))]
    threads: Option<u16>,
    /// Precision of the state
    #[arg(long, value_enum, default_value = "f32")]
    precision: PrecisionName,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct StomakhinRow {
    /// Its times are those of a frame.
    #[serde(flatten)]
    row: Row,
    /// Time of the slowest frame (s).
    max_seconds: f64,
    /// Time of each frame (s), in order.
    frame_seconds: Vec<f64>,
    /// Steps of the snow of each frame, in order.
    frame_substeps: Vec<u32>,
    /// Particles times steps of the snow, over the seconds of all frames.
    particle_steps_per_second: f64,
    /// Time of a frame in the paper (s); none for another number of particles.
    published_seconds: Option<f64>,
    /// The paper's time over our median.
    published_ratio: Option<f64>,
    state_hash: String,
}

/// Runs `nappe bench stomakhin`.
///
/// # Errors
/// When the run fails.
pub(crate) fn run(args: &StomakhinArgs) -> Result<()> {
    let throw = Throw {
        particles: args.particles as usize,
        cell: 0.005,
        velocity: [5.0, 0.0, 0.0],
        dt: 1.0 / 24.0,
        normals: &[[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    };
    let row = measure(args, &throw)?;
    match args.output.format() {
        Format::Json => output::json(&[row]),
        Format::Text => output::line(&text(&row, throw.radius())),
    }
}

fn measure(args: &StomakhinArgs, throw: &Throw) -> Result<StomakhinRow> {
    let threads = args.threads.map_or_else(rayon::current_num_threads, usize::from);
    let precision = Precision::from(args.precision);
    output::note(&format!(
        "{} of {} particles ...",
        output::several(args.frames.into(), "frame"),
        output::count(args.particles.into())
    ));

    let steps = StepCounts { warm_up: 0, timed: args.frames as usize };
    let timing = timings::measure(&throw.world()?, precision, &[threads], steps)?.remove(0);

    let frame_seconds: Vec<f64> = timing.samples.iter().map(|sample| sample.seconds).collect();
    let frame_substeps: Vec<u32> = timing.samples.iter().map(|sample| sample.substeps).collect();
    let median_seconds = sample::median(frame_seconds.iter().copied());
    let substeps: f64 = frame_substeps.iter().copied().map(f64::from).sum();

    let published = (args.particles == 300_000).then_some(PUBLISHED_SECONDS);
    Ok(StomakhinRow {
        row: Row {
            name: "snow/stomakhin".to_owned(),
            particles: throw.particles,
            threads: timing.threads,
            precision: precision.name(),
            median_seconds,
            min_seconds: sample::minimum(frame_seconds.iter().copied()),
            rate: 1.0 / median_seconds,
            unit: "frames/s",
        },
        max_seconds: frame_seconds.iter().copied().fold(0.0, f64::max),
        particle_steps_per_second: throw.particles as f64 * substeps / frame_seconds.iter().sum::<f64>(),
        frame_seconds,
        frame_substeps,
        published_seconds: published,
        published_ratio: published.map(|seconds| seconds / median_seconds),
        state_hash: output::hash(timing.state_hash),
    })
}

fn text(row: &StomakhinRow, radius: f64) -> String {
    let columns = [Column::Right("frame"), Column::Right("seconds"), Column::Right("steps of the snow")];
    let frames = row.frame_seconds.iter().zip(&row.frame_substeps);
    let cells: Vec<Vec<String>> = (1..)
        .zip(frames)
        .map(|(frame, (seconds, substeps)): (u32, _)| {
            vec![frame.to_string(), format!("{seconds:.2}"), output::count((*substeps).into())]
        })
        .collect();

    let beside = row.published_ratio.map_or_else(String::new, |ratio| {
        format!(" Stomakhin et al. 2013: 5.2 minutes per frame for 300 000 particles, {ratio:.0} times the median here.")
    });
    format!(
        "{}\n\n{} per frame of 1/24 s (median), {:.1} million particle-steps per second, {}, {}.{beside}\n{} particles, 8 per cell of 5 mm, a ball of radius {:.3} m that hits a wall at 5 m/s.",
        output::table(&columns, &cells),
        output::time(row.row.median_seconds),
        row.particle_steps_per_second / 1e6,
        output::several(row.row.threads as u64, "thread"),
        row.row.precision,
        output::count(row.row.particles as u64),
        radius,
    )
}

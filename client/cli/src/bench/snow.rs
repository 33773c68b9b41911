//! `nappe bench snow`: particle-steps per second of explicit snow, time per stage, memory. The snow is MLS with
//! a quadratic kernel and plasticity, in both precisions, on one thread and on all, straight on the simulation library.
//!
//! A ball flies at 3 m/s to a floor and deforms. A step of the world is several steps of the snow, as the
//! certified bound asks; those are counted, and sorting, bounds and diagnostics are part of them.

use std::collections::BTreeMap;

use clap::Args;
use nappe_server::numbers::whole;
use nappe_sim::{math::Precision, report::Stage};
use serde::Serialize;

use super::{
    ball::Throw,
    row::{Row, thread_counts},
    sample::{self, Sample},
    timings::{self, StepCounts, Timing},
    triad,
};
use crate::{
    options::args::PrecisionName,
    words::{
        error::Result,
        output::{self, Column, Format, OutputArgs},
    },
};

/// Particles timed in binary64 unless a precision is given.
const MOST_F64: usize = 200_000;
/// Side of a cell (m).
const CELL: f64 = 1.0 / 128.0;
/// Stages of a step of snow.
const STAGES: [Stage; 5] =
    [Stage::Sort, Stage::ParticlesToGrid, Stage::GridUpdate, Stage::GridToParticles, Stage::Diagnose];

/// Snow of 200 000 and 1 000 000 particles: particle-steps per second, time per stage, memory
#[derive(Args, Debug)]
pub(crate) struct SnowArgs {
    /// Particles of each ball
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', default_values_t = [200_000, 1_000_000],
          value_parser = whole::<u32>(1_000..=20_000_000))]
    particles: Vec<u32>,
    /// Steps of the world timed, after two that are not; each is several steps of the snow
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = whole::<u32>(1..))]
    repetitions: u32,
    /// Threads of the second measurement [default: all cores]
    #[arg(long, value_name = "T", value_parser = whole::<u16>(1..))]
    threads: Option<u16>,
    /// Precision of the state [default: f32, and f64 up to 200 000 particles]
    #[arg(long, value_enum)]
    precision: Option<PrecisionName>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct SnowRow {
    /// Seconds of a step of the snow; the rate is particles over its median.
    #[serde(flatten)]
    row: Row,
    /// Particles over the fastest step.
    best_rate: f64,
    /// Steps of the snow that were timed.
    substeps: u64,
    /// Nanoseconds of each stage per particle and step of the snow, medians.
    stage_nanoseconds: BTreeMap<&'static str, f64>,
    /// Median of the time on one thread over the time on these threads.
    speedup: f64,
    /// Memory of the snow per particle (bytes), grid included.
    bytes_per_particle: f64,
    /// Bytes of particles that a step of the snow moves if none of them stays in cache, write-allocates included.
    bytes_per_step: f64,
    /// These bytes per second of a step, over those of a triad on the same threads in the same run.
    bandwidth_share: f64,
    state_hash: String,
    /// Time of that hash over the median of a step of the snow.
    hash_share: f64,
}

/// Runs `nappe bench snow`.
///
/// # Errors
/// When a run fails.
pub(crate) fn run(args: &SnowArgs) -> Result<()> {
    let threads = thread_counts(args.threads);
    let bandwidths = triad::bandwidths(&threads)?;
    let mut rows = Vec::new();
    for &particles in &args.particles {
        let throw = Throw {
            particles: particles as usize,
            cell: CELL,
            velocity: [0.0, -3.0, 0.0],
            dt: 1e-3,
            normals: &[[0.0, 1.0, 0.0]],
        };
        let setup = throw.world()?;
        for precision in precisions(args.precision, throw.particles) {
            output::note(&format!("{} particles, {precision} ...", output::count(particles.into())));
            let steps = StepCounts { warm_up: 2, timed: args.repetitions as usize };
            let timings = timings::measure(&setup, precision, &threads, steps)?;
            let row = |(timing, bandwidth): (&Timing, &f64)| {
                snow_row([timing, &timings[0]], precision, throw.particles, *bandwidth)
            };
            rows.extend(timings.iter().zip(&bandwidths).map(row));
        }
    }
    match args.output.format() {
        Format::Json => output::json(&rows),
        Format::Text => output::line(&text(&rows)),
    }
}

fn precisions(wanted: Option<PrecisionName>, particles: usize) -> Vec<Precision> {
    match wanted {
        Some(precision) => vec![precision.into()],
        None if particles <= MOST_F64 => vec![Precision::F32, Precision::F64],
        None => vec![Precision::F32],
    }
}

/// Seconds of a step of the snow in each step of the world.
fn substep_seconds(samples: &[Sample]) -> impl Iterator<Item = f64> {
    samples.iter().map(|sample| sample.seconds / f64::from(sample.substeps.max(1)))
}

fn snow_row(
    [timing, single]: [&Timing; 2],
    precision: Precision,
    particles: usize,
    bandwidth: f64,
) -> SnowRow {
    let median_seconds = sample::median(substep_seconds(&timing.samples));
    let min_seconds = sample::minimum(substep_seconds(&timing.samples));
    let ratios = substep_seconds(&single.samples).zip(substep_seconds(&timing.samples));

    let nanoseconds = |stage: Stage| {
        let index = Stage::ALL.iter().position(|known| *known == stage).expect("ALL holds every stage");
        let shares = timing.samples.iter().map(|s| s.stages[index] / f64::from(s.substeps.max(1)));
        1e9 * sample::median(shares) / particles as f64
    };

    let bytes_per_step = particles as f64 * bytes_of_a_particle(precision);
    SnowRow {
        row: Row {
            name: "snow/mls_quadratic".to_owned(),
            particles,
            threads: timing.threads,
            precision: precision.name(),
            median_seconds,
            min_seconds,
            rate: particles as f64 / median_seconds,
            unit: "particle-steps/s",
        },
        best_rate: particles as f64 / min_seconds,
        substeps: timing.samples.iter().map(|s| u64::from(s.substeps)).sum(),
        stage_nanoseconds: STAGES.iter().map(|stage| (stage.name(), nanoseconds(*stage))).collect(),
        speedup: sample::median(ratios.map(|(one, many)| one / many)),
        bytes_per_particle: timing.snow_bytes as f64 / particles as f64,
        bytes_per_step,
        bandwidth_share: bytes_per_step / median_seconds / bandwidth,
        state_hash: output::hash(timing.state_hash),
        hash_share: timing.hash_seconds / median_seconds,
    }
}

/// Bytes of a particle in a step. To the grid go its position, mass, velocity and J_P (8 numbers), a part of F_E, C and
/// V0 tau (16). From the grid these 8 are read and written, and F_E with a part of C (16); the rest of C and V0 tau (8) is
/// written without being read, which counts twice; volume and factor (2) are read. The order is read three times and
/// written anew, a code of two bytes is written and read, and the number of the object is read. Nodes have four numbers for
/// eight particles, and stay in cache.
fn bytes_of_a_particle(precision: Precision) -> f64 {
    let number = match precision {
        Precision::F32 => 4.0,
        Precision::F64 => 8.0,
    };
    let to_grid = 8.0 + 16.0;
    let from_grid = 2.0 * (8.0 + 16.0 + 8.0) + 2.0;
    let order = (3.0 + 2.0) * 4.0;
    let code_and_object = (2.0 + 1.0 + 1.0) * 2.0;
    (to_grid + from_grid) * number + order + code_and_object
}

fn text(rows: &[SnowRow]) -> String {
    let mut columns = vec![
        Column::Right("particles"),
        Column::Left("precision"),
        Column::Right("threads"),
        Column::Right("M/s"),
        Column::Right("fastest"),
        Column::Right("speed-up"),
    ];
    columns.extend(STAGES.iter().map(|stage| Column::Right(stage.name())));
    columns.extend([Column::Right("bytes"), Column::Right("of a triad's bytes/s"), Column::Right("hash")]);

    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let mut cells = vec![
                output::count(row.row.particles as u64),
                row.row.precision.to_owned(),
                row.row.threads.to_string(),
                format!("{:.1}", row.row.rate / 1e6),
                format!("{:.1}", row.best_rate / 1e6),
                format!("{:.2}", row.speedup),
            ];
            cells.extend(STAGES.iter().map(|stage| format!("{:.1}", row.stage_nanoseconds[stage.name()])));
            cells.push(format!("{:.0}", row.bytes_per_particle));
            cells.push(format!("{:.2}", row.bandwidth_share));
            cells.push(format!("{:.2}", row.hash_share));
            cells
        })
        .collect();
    format!(
        "{}\n\nM/s: millions of particle-steps per second, sorting, bound and diagnostics included; medians and the fastest step.\nStages: nanoseconds per particle and step of the snow. Bytes: memory of the snow per particle, grid included. Of a triad's bytes/s: bytes of particles that a step moves, counted, over what a triad moves in the same time. Hash: time of the state's hash over that of a step.\nA ball of snow (Stomakhin et al. 2013), 8 particles per cell of 1/128 m, falls on a floor at 3 m/s; MLS, quadratic kernel, explicit.",
        output::table(&columns, &cells)
    )
}

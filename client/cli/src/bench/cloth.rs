//! `nappe bench cloth`: seconds per step of a large sheet, implicit and explicit, and of thick cloth if asked. On one
//! thread and on all, straight on the simulation library; the sheet in both precisions.

use std::collections::BTreeMap;

use clap::Args;
use nappe_server::numbers::whole;
use nappe_sim::{
    cloth::{Integrator, Network},
    math::Precision,
    report::Stage,
};
use serde::Serialize;

use super::{
    row::{Row, thread_counts},
    sample, sheet, thick,
    timings::{self, StepCounts, Timing},
    triad,
};
use crate::words::{
    error::Result,
    output::{self, Column, Format, OutputArgs},
};

/// A 400 x 400 sheet with 956 002 springs: seconds per step, on one thread and on all
#[derive(Args, Debug)]
pub(crate) struct ClothArgs {
    /// Particles along a side of the sheet
    #[arg(long, value_name = "N", default_value_t = 400, value_parser = whole::<u32>(8..=2000))]
    side: u32,
    /// Steps timed of each cloth in each precision, on each number of threads
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = whole::<u32>(1..))]
    repetitions: u32,
    /// Threads of the second measurement [default: all cores]
    #[arg(long, value_name = "T", value_parser = whole::<u16>(1..))]
    threads: Option<u16>,
    /// Time cloth with a thickness too, which takes a minute to begin
    #[arg(long)]
    thick: bool,
    #[command(flatten)]
    output: OutputArgs,
}

/// A measurement of any cloth.
#[derive(Serialize)]
#[serde(untagged)]
enum AnyRow {
    Sheet(ClothRow),
    Thick(thick::ThickRow),
}

#[derive(Serialize)]
struct ClothRow {
    #[serde(flatten)]
    row: Row,
    springs: usize,
    /// Median over steps of the time on one thread over the time on these threads.
    speedup: f64,
    state_hash: String,
    /// Median seconds of each stage that takes any.
    stages: BTreeMap<&'static str, f64>,
    /// Bytes that an iteration of the solver moves if no vector stays in cache, write-allocates included; of implicit
    /// steps of springs.
    bytes_per_iteration: Option<f64>,
    /// These bytes per second of the solve, over those of a triad on the same threads in the same run: more than 1
    /// where caches hold part of it.
    bandwidth_share: Option<f64>,
}

/// What is timed.
struct Case {
    name: &'static str,
    integrator: Integrator,
    network: Network,
}

/// Runs `nappe bench cloth`.
///
/// # Errors
/// When a run fails.
pub(crate) fn run(args: &ClothArgs) -> Result<()> {
    let (network, irregular, fabric) = (sheet::network, sheet::irregular, sheet::membrane_plate);
    let case = |name, integrator, make: fn(usize) -> Network| Case {
        name,
        integrator,
        network: make(args.side as usize),
    };
    let cases = [
        case("implicit_euler", Integrator::ImplicitEuler, network),
        case("implicit_euler_irregular", Integrator::ImplicitEuler, irregular),
        case("membrane_plate", Integrator::ImplicitEuler, fabric),
        case("symplectic_euler", Integrator::SymplecticEuler, network),
    ];

    let threads = thread_counts(args.threads);
    let bandwidths = triad::bandwidths(&threads)?;
    let mut rows = Vec::new();
    for case in &cases {
        let setup = sheet::world(&case.network, case.integrator)?;
        for precision in Precision::ALL {
            output::note(&format!("{}, {precision} ...", case.name));
            let steps = StepCounts { warm_up: 2, timed: args.repetitions as usize };
            let timings = timings::measure(&setup, precision, &threads, steps)?;
            let row = |(timing, bandwidth): (&Timing, &f64)| {
                cloth_row(case, precision, [timing, &timings[0]], *bandwidth)
            };
            rows.extend(timings.iter().zip(&bandwidths).map(row));
        }
    }
    let thick = if args.thick { thick::rows(&threads, args.repetitions as usize)? } else { Vec::new() };
    match args.output.format() {
        Format::Json => {
            let rows = rows.into_iter().map(AnyRow::Sheet).chain(thick.into_iter().map(AnyRow::Thick));
            output::json(&rows.collect::<Vec<_>>())
        }
        Format::Text if thick.is_empty() => output::line(&text(&rows)),
        Format::Text => output::line(&format!("{}\n\n{}", text(&rows), thick::text(&thick))),
    }
}

fn cloth_row(
    Case { name, integrator, network }: &Case,
    precision: Precision,
    [timing, single]: [&Timing; 2],
    bandwidth: f64,
) -> ClothRow {
    let median_seconds = sample::median(timing.samples.iter().map(|s| s.seconds));
    let ratios = single.samples.iter().zip(&timing.samples).map(|(one, many)| one.seconds / many.seconds);
    let stages = sample::named_stages(&timing.samples);
    let is_counted = integrator.is_implicit() && network.elements.is_empty();
    let bytes_per_iteration = is_counted.then(|| bytes_per_iteration(network, precision));
    let solve = stages.get(Stage::Solve.name()).copied();
    ClothRow {
        row: Row {
            name: format!("cloth/{name}"),
            particles: network.x.len(),
            threads: timing.threads,
            precision: precision.name(),
            median_seconds,
            min_seconds: sample::minimum(timing.samples.iter().map(|s| s.seconds)),
            rate: 1.0 / median_seconds,
            unit: "steps/s",
        },
        springs: network.springs.len(),
        speedup: sample::median(ratios),
        state_hash: output::hash(timing.state_hash),
        bytes_per_iteration,
        bandwidth_share: bytes_per_iteration
            .zip(solve)
            .map(|(bytes, seconds)| bytes * f64::from(sheet::ITERATIONS) / seconds / bandwidth),
        stages,
    }
}

/// Bytes of an iteration: for each end of a spring its index and b; for each particle positions and direction (padded
/// to four numbers), mass, its inverse and the product; then the residual, the product and M⁻¹ r in its place, and six
/// binary32 factors of an inverse block; then the solution, M⁻¹ r and the direction. What is written without being read
/// is counted twice.
fn bytes_per_iteration(network: &Network, precision: Precision) -> f64 {
    let number = match precision {
        Precision::F32 => 4.0,
        Precision::F64 => 8.0,
    };
    let ends = 2.0 * network.springs.len() as f64 * (2.0 + number);
    let product = (4.0 + 4.0 + 2.0 + 6.0) * number;
    let residual = (6.0 + 6.0) * number + 24.0;
    let turn = (6.0 + 3.0 + 8.0) * number;
    ends + network.x.len() as f64 * (product + residual + turn)
}

fn text(rows: &[ClothRow]) -> String {
    let columns = [
        Column::Left("integrator"),
        Column::Left("precision"),
        Column::Right("threads"),
        Column::Right("median"),
        Column::Right("fastest"),
        Column::Right("steps/s"),
        Column::Right("speed-up"),
        Column::Right("of a triad's bytes/s"),
    ];

    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            vec![
                row.row.name.trim_start_matches("cloth/").to_owned(),
                row.row.precision.to_owned(),
                row.row.threads.to_string(),
                output::time(row.row.median_seconds),
                output::time(row.row.min_seconds),
                format!("{:.1}", row.row.rate),
                format!("{:.2}", row.speedup),
                row.bandwidth_share.map_or_else(String::new, |share| format!("{share:.2}")),
            ]
        })
        .collect();

    let size = rows.first().map_or_else(String::new, |row| {
        format!(
            "{} particles, {} springs (stretch, shear, bend); implicit: dt {} s, {} iterations from zero; explicit: half of the stable step; membrane_plate: those laws in place of springs.\n\n",
            output::count(row.row.particles as u64),
            output::count(row.springs as u64),
            sheet::IMPLICIT_DT,
            sheet::ITERATIONS,
        )
    });
    format!(
        "{size}{}\n\nThe speed-up is the median, over steps taken in turn, of the time on one thread over this time.",
        output::table(&columns, &cells)
    )
}

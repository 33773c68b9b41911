//! `nappe bench cloth`: seconds per step of a large sheet, implicit and explicit, in both
//! precisions, on one thread and on all. Straight on the simulation library.

use clap::Args;
use nappe_sim::{cloth::Integrator, math::Precision};
use serde::Serialize;

use super::{
    row::{Row, thread_counts},
    sample, sheet,
    timings::{self, StepCounts, Timing},
};
use crate::{
    error::Result,
    output::{self, Column, Format, OutputArgs},
};

/// A 400 x 400 sheet with 956 002 springs: seconds per step, f32 and f64, on one thread and on all
#[derive(Args, Debug)]
pub(crate) struct ClothArgs {
    /// Particles along a side of the sheet
    #[arg(long, value_name = "N", default_value_t = 400, value_parser = clap::value_parser!(u32).range(8..=2000))]
    side: u32,
    /// Steps timed in each precision, on each number of threads
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    repetitions: u32,
    /// Threads of the second measurement [default: all cores]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct ClothRow {
    #[serde(flatten)]
    row: Row,
    springs: usize,
    /// Median over steps of the time on one thread over the time on these threads.
    speedup: f64,
    state_hash: String,
}

/// Runs `nappe bench cloth`.
///
/// # Errors
/// When a run fails.
pub(crate) fn run(args: &ClothArgs) -> Result<()> {
    let network = sheet::network(args.side as usize);
    let mut rows = Vec::new();
    for integrator in [Integrator::ImplicitEuler, Integrator::SymplecticEuler] {
        let setup = sheet::world(&network, integrator)?;
        for precision in Precision::ALL {
            output::note(&format!("{}, {precision} ...", integrator.name()));
            let steps = StepCounts { warm_up: 2, timed: args.repetitions as usize };
            let timings = timings::measure(&setup, precision, &thread_counts(args.threads), steps)?;
            rows.extend(timings.iter().map(|timing| {
                cloth_row(
                    timing,
                    &timings[0],
                    integrator,
                    precision,
                    [network.x.len(), network.springs.len()],
                )
            }));
        }
    }
    match args.output.format() {
        Format::Json => output::json(&rows),
        Format::Text => output::line(&text(&rows)),
    }
}

fn cloth_row(
    timing: &Timing,
    single: &Timing,
    integrator: Integrator,
    precision: Precision,
    [particles, springs]: [usize; 2],
) -> ClothRow {
    let median_seconds = sample::median(timing.samples.iter().map(|s| s.seconds));
    let ratios = single.samples.iter().zip(&timing.samples).map(|(one, many)| one.seconds / many.seconds);
    ClothRow {
        row: Row {
            name: format!("cloth/{}", integrator.name()),
            particles,
            threads: timing.threads,
            precision: precision.name(),
            median_seconds,
            min_seconds: sample::minimum(timing.samples.iter().map(|s| s.seconds)),
            rate: 1.0 / median_seconds,
            unit: "steps/s",
        },
        springs,
        speedup: sample::median(ratios),
        state_hash: output::hash(timing.state_hash),
    }
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
    ];

    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            vec![
                row.row.name.trim_start_matches("cloth/").to_owned(),
                row.row.precision.to_owned(),
                row.row.threads.to_string(),
                output::duration(row.row.median_seconds),
                output::duration(row.row.min_seconds),
                format!("{:.1}", row.row.rate),
                format!("{:.2}", row.speedup),
            ]
        })
        .collect();

    let size = rows.first().map_or_else(String::new, |row| {
        format!(
            "{} particles, {} springs (stretch, shear, bend); implicit: dt {} s, {} iterations from zero; explicit: half of the stable step.\n\n",
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

//! `nappe bench zara`: the table of Zara 2001, section 6, on this machine.
//!
//! Time of each stage and of a frame, which is one step, for the paper's sheet sizes, explicit and
//! implicit, on one thread and on all, beside the paper's own times. Straight on the simulation
//! library, without gRPC.

use std::collections::BTreeMap;

use clap::Args;
use nappe_server::numbers::whole;
use nappe_sim::{cloth::Network, math::Precision, report::Stage};
use serde::Serialize;

use super::{
    paper::{self, PublishedTime, Scheme},
    row::{Row, thread_counts},
    sample, sheet,
    timings::{self, StepCounts, Timing},
};
use crate::{
    options::args::PrecisionName,
    words::{
        error::{CliError, Result},
        output::{self, Column, Format, OutputArgs},
    },
};

/// The table of Zara 2001: seconds of each stage and of a frame, beside the paper's own times
#[derive(Args, Debug)]
pub(crate) struct ZaraArgs {
    /// Particles of each sheet, square numbers
    #[arg(long, value_name = "N,N,...", value_delimiter = ',',
          default_values_t = [2_500, 10_000, 22_500, 90_000, 122_500, 160_000])]
    sizes: Vec<usize>,
    /// Steps timed, after one that is not
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = whole::<u32>(1..))]
    steps: u32,
    /// Threads of the second measurement [default: all cores]
    #[arg(long, value_name = "T", value_parser = whole::<u16>(1..))]
    threads: Option<u16>,
    /// Precision of positions and velocities
    #[arg(long, value_enum, default_value = "f64")]
    precision: PrecisionName,
    /// Print comma-separated values on standard output, for a spreadsheet
    #[arg(long, conflicts_with = "json", help_heading = "Output")]
    csv: bool,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct ZaraRow {
    #[serde(flatten)]
    row: Row,
    springs: usize,
    stages: BTreeMap<&'static str, f64>,
    state_hash: String,
    paper: Vec<PublishedTime>,
}

/// Runs `nappe bench zara`.
///
/// # Errors
/// When a size is not a square of at least 8, or a run fails.
pub(crate) fn run(args: &ZaraArgs) -> Result<()> {
    let sides = args.sizes.iter().map(|&n| side(n)).collect::<Result<Vec<_>>>()?;
    let mut rows = Vec::new();
    for side in sides {
        let network = sheet::network(side);
        for scheme in Scheme::ALL {
            output::note(&format!(
                "{} particles, {} springs, {} ...",
                output::count(network.x.len() as u64),
                output::count(network.springs.len() as u64),
                scheme.name()
            ));
            let setup = sheet::world(&network, scheme.integrator())?;
            let steps = StepCounts { warm_up: 1, timed: args.steps as usize };
            let precision = Precision::from(args.precision);
            let timings = timings::measure(&setup, precision, &thread_counts(args.threads), steps)?;
            rows.extend(timings.iter().map(|timing| zara_row(timing, scheme, precision, &network)));
        }
    }

    match (args.output.format(), args.csv) {
        (Format::Json, _) => output::json(&rows),
        (Format::Text, true) => output::line(&csv(&rows)),
        (Format::Text, false) => output::line(&text(&rows)),
    }
}

fn side(particles: usize) -> Result<usize> {
    let side = particles.isqrt();
    if side * side == particles && side >= 8 {
        return Ok(side);
    }
    Err(CliError::usage(format!("--sizes: {particles} particles do not make a square sheet"))
        .hint("give squares of 8 or more: 64, 2500, 10000, 160000 ..."))
}

fn zara_row(timing: &Timing, scheme: Scheme, precision: Precision, network: &Network) -> ZaraRow {
    let median_seconds = sample::median(timing.samples.iter().map(|s| s.seconds));
    let stages = sample::median_stages(&timing.samples);
    let particles = network.x.len();
    ZaraRow {
        row: Row {
            name: format!("zara/{}", scheme.name()),
            particles,
            threads: timing.threads,
            precision: precision.name(),
            median_seconds,
            min_seconds: sample::minimum(timing.samples.iter().map(|s| s.seconds)),
            rate: 1.0 / median_seconds,
            unit: "frames/s",
        },
        springs: network.springs.len(),
        stages: Stage::ALL.iter().zip(stages).map(|(stage, seconds)| (stage.name(), seconds)).collect(),
        state_hash: output::hash(timing.state_hash),
        paper: paper::published_times(scheme, particles),
    }
}

fn csv(rows: &[ZaraRow]) -> String {
    let stages: Vec<_> = Stage::ALL.iter().map(|stage| format!("{}_seconds", stage.name())).collect();
    let mut lines = vec![format!(
        "name,particles,springs,threads,precision,median_seconds,min_seconds,rate,unit,{},paper_machine_1,paper_seconds_1,paper_machine_2,paper_seconds_2",
        stages.join(",")
    )];
    for row in rows {
        let Row { name, particles, threads, precision, median_seconds, min_seconds, rate, unit } = &row.row;
        let mut line = format!(
            "{name},{particles},{},{threads},{precision},{median_seconds},{min_seconds},{rate},{unit}",
            row.springs
        );
        line.extend(Stage::ALL.iter().map(|stage| format!(",{}", row.stages[stage.name()])));
        for slot in 0..2 {
            line += &row.paper.get(slot).map_or_else(
                || ",,".to_owned(),
                |time| format!(",\"{}\",{}", time.machine.label(), time.seconds),
            );
        }
        lines.push(line);
    }
    lines.join("\n")
}

fn text(rows: &[ZaraRow]) -> String {
    let mut columns = vec![Column::Left("scheme"), Column::Right("particles"), Column::Right("threads")];
    let takes_time = |stage: &Stage| rows.iter().any(|row| row.stages[stage.name()] > 0.0);
    let shown: Vec<&str> = Stage::ALL.iter().filter(|stage| takes_time(stage)).map(|s| s.name()).collect();
    columns.extend(shown.iter().map(|name| Column::Right(name)));
    columns.extend([Column::Right("frame"), Column::Left("Zara 2001, per frame")]);

    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let mut cells = vec![
                row.row.name.trim_start_matches("zara/").to_owned(),
                output::count(row.row.particles as u64),
                row.row.threads.to_string(),
            ];
            cells.extend(shown.iter().map(|name| stage_cell(row.stages[name])));
            cells.push(output::time(row.row.median_seconds));
            cells.push(paper_cell(&row.paper));
            cells
        })
        .collect();
    format!(
        "{}\n\nMedians of a step; a frame is one step. Stretch, shear and bend springs, {} iterations of the conjugate gradient\nfrom zero, {}. Of the paper's machines: a cluster of Pentium III at 733 MHz, and an SMP of four Pentium Pro at 200 MHz.",
        output::table(&columns, &cells),
        sheet::ITERATIONS,
        rows.first().map_or("f64", |row| row.row.precision),
    )
}

fn stage_cell(seconds: f64) -> String {
    if seconds > 0.0 { output::time(seconds) } else { "-".to_owned() }
}

fn paper_cell(times: &[PublishedTime]) -> String {
    if times.is_empty() {
        return "-".to_owned();
    }
    let parts: Vec<_> =
        times.iter().map(|time| format!("{} s ({})", time.seconds, time.machine.label())).collect();
    parts.join(", ")
}

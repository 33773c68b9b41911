//! `nappe bench zara`: the table of Zara 2001, section 6, on this machine.
//!
//! Time of each stage and of a frame, which is one step, for the paper's sheet sizes, explicit and
//! implicit, on one thread and on all, beside the paper's figures. Straight on the simulation
//! library, without gRPC.

use std::collections::BTreeMap;

use clap::Args;
use nappe_sim::{cloth::Integrator, math::Precision, report::Stage};
use serde::Serialize;

use super::{
    Row,
    paper::{self, Figure},
    race::{self, Laps},
    sample::{self, Stages},
    sheet, thread_counts,
};
use crate::{
    args::PrecisionName,
    error::{CliError, Result},
    output::{self, Column, Format, OutputArgs},
};

/// Options of `nappe bench zara`.
#[derive(Args, Debug)]
pub(crate) struct ZaraArgs {
    /// Particles of each sheet, square numbers
    #[arg(long, value_name = "N,N,...", value_delimiter = ',',
          default_values_t = [2_500, 10_000, 22_500, 90_000, 122_500, 160_000])]
    sizes: Vec<usize>,
    /// Steps timed, after one that is not
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
    /// Threads of the second measurement [default: all cores]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..))]
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

/// How a step is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scheme {
    /// Explicit Euler (section 3.2 of the paper).
    Explicit,
    /// Implicit Euler, ten iterations of the conjugate gradient from zero (algorithm 1).
    Implicit,
}

impl Scheme {
    const ALL: [Self; 2] = [Self::Explicit, Self::Implicit];

    const fn name(self) -> &'static str {
        match self {
            Self::Explicit => "explicit",
            Self::Implicit => "implicit",
        }
    }

    const fn integrator(self) -> Integrator {
        match self {
            Self::Explicit => Integrator::ExplicitEuler,
            Self::Implicit => Integrator::ImplicitEuler,
        }
    }
}

#[derive(Serialize)]
struct ZaraRow {
    #[serde(flatten)]
    row: Row,
    springs: usize,
    stages: BTreeMap<&'static str, f64>,
    state_hash: String,
    paper: Vec<Figure>,
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
            let laps = Laps { warm_up: 1, counted: args.steps as usize };
            let precision = Precision::from(args.precision);
            let lanes = race::race(&setup, precision, &thread_counts(args.threads), laps)?;
            rows.extend(lanes.iter().map(|lane| zara_row(lane, scheme, precision, &network)));
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

fn zara_row(
    lane: &race::Lane,
    scheme: Scheme,
    precision: Precision,
    network: &nappe_sim::cloth::Network,
) -> ZaraRow {
    let median_seconds = sample::median(lane.samples.iter().map(|s| s.seconds));
    let stages: Stages = sample::median_stages(&lane.samples);
    let particles = network.x.len();
    ZaraRow {
        row: Row {
            name: format!("zara/{}", scheme.name()),
            particles,
            threads: lane.threads,
            precision: precision.name(),
            median_seconds,
            min_seconds: sample::minimum(lane.samples.iter().map(|s| s.seconds)),
            rate: 1.0 / median_seconds,
            unit: "frames/s",
        },
        springs: network.springs.len(),
        stages: Stage::ALL.iter().zip(stages).map(|(stage, seconds)| (stage.name(), seconds)).collect(),
        state_hash: output::hash(lane.state_hash),
        paper: paper::figures(scheme, particles),
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
                |figure| format!(",\"{}\",{}", figure.machine.label(), figure.seconds),
            );
        }
        lines.push(line);
    }
    lines.join("\n")
}

fn text(rows: &[ZaraRow]) -> String {
    let mut columns = vec![Column::Left("scheme"), Column::Right("particles"), Column::Right("threads")];
    columns.extend(Stage::ALL.iter().map(|stage| Column::Right(stage.name())));
    columns.extend([Column::Right("frame"), Column::Left("Zara 2001, a frame")]);
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let mut cells = vec![
                row.row.name.trim_start_matches("zara/").to_owned(),
                output::count(row.row.particles as u64),
                row.row.threads.to_string(),
            ];
            cells.extend(Stage::ALL.iter().map(|stage| stage_cell(row.stages[stage.name()])));
            cells.push(output::duration(row.row.median_seconds));
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
    if seconds > 0.0 { output::duration(seconds) } else { "-".to_owned() }
}

fn paper_cell(figures: &[Figure]) -> String {
    if figures.is_empty() {
        return "-".to_owned();
    }
    let parts: Vec<_> =
        figures.iter().map(|figure| format!("{} s ({})", figure.seconds, figure.machine.label())).collect();
    parts.join(", ")
}

//! `nappe bench zara`: the table of Zara 2001, section 6, on this machine.
//!
//! Time of each task by itself and of a frame, which is one step, for the paper's sheet sizes, explicit and
//! implicit, on one thread and on all, beside the paper's own times. Straight on the simulation
//! library, without gRPC.

use std::collections::BTreeMap;

use clap::Args;
use nappe_server::numbers::whole;
use nappe_sim::{cloth::Network, math::Precision, report::Task};
use serde::Serialize;

use super::{
    paper::{self, PublishedTime, Scheme},
    row::{Row, thread_counts},
    sample, sheet,
    timings::{self, StepCounts, TaskSeconds, Timing},
};
use crate::{
    options::args::PrecisionName,
    words::{
        error::{CliError, Result},
        output::{self, Column, Format, OutputArgs},
    },
};

/// The table of Zara 2001: seconds of each task and of a frame, beside the paper's own times
#[derive(Args, Debug)]
pub(crate) struct ZaraArgs {
    /// Particles of each sheet, square numbers
    #[arg(long, value_name = "N,N,...", value_delimiter = ',',
          default_values_t = [2_500, 10_000, 22_500, 90_000, 122_500, 160_000])]
    sizes: Vec<usize>,
    /// Steps timed, and then tasks, each after one that is not
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
    /// Median seconds of each stage of a step that takes any.
    stages: BTreeMap<&'static str, f64>,
    /// Median seconds of each task that its steps have, done by itself.
    tasks: BTreeMap<&'static str, f64>,
    state_hash: String,
    paper: Vec<PublishedTime>,
}

/// The tasks of the paper in the order of its table, and the solve.
const TASKS: [&str; 6] = ["force", "acceleration", "velocity", "position", "matrix", "solve"];

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
            let threads = thread_counts(args.threads);
            let timings = timings::measure_with_tasks(&setup, precision, &threads, steps)?;
            let row = |(timing, tasks): &(Timing, Vec<TaskSeconds>)| {
                let tasks = medians(tasks, scheme);
                zara_row(timing, tasks, (scheme, precision), &network)
            };
            rows.extend(timings.iter().map(row));
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

/// The median of each task that the steps of a scheme have (s).
fn medians(samples: &[TaskSeconds], scheme: Scheme) -> BTreeMap<&'static str, f64> {
    let median = |of: &dyn Fn(&TaskSeconds) -> f64| sample::median(samples.iter().map(of));
    let task = |task: Task| median(&|seconds| seconds[task as usize]);
    let mut medians = BTreeMap::from([
        ("force", task(Task::Force)),
        ("acceleration", task(Task::Acceleration)),
        ("velocity", task(Task::Velocity)),
        ("position", task(Task::Position)),
    ]);
    if scheme.integrator().is_implicit() {
        // Forces are evaluated with the matrix: what that takes longer is the time of the matrix.
        let matrix =
            |seconds: &TaskSeconds| seconds[Task::ForceAndMatrix as usize] - seconds[Task::Force as usize];
        medians.extend([("matrix", median(&matrix)), ("solve", task(Task::Solve))]);
    }
    medians
}

fn zara_row(
    timing: &Timing,
    tasks: BTreeMap<&'static str, f64>,
    (scheme, precision): (Scheme, Precision),
    network: &Network,
) -> ZaraRow {
    let median_seconds = sample::median(timing.samples.iter().map(|s| s.seconds));
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
        stages: sample::named_stages(&timing.samples),
        tasks,
        state_hash: output::hash(timing.state_hash),
        paper: paper::published_times(scheme, particles),
    }
}

fn csv(rows: &[ZaraRow]) -> String {
    let tasks = TASKS.map(|task| format!("{task}_seconds"));
    let mut lines = vec![format!(
        "name,particles,springs,threads,precision,median_seconds,min_seconds,rate,unit,{},paper_machine_1,paper_seconds_1,paper_machine_2,paper_seconds_2",
        tasks.join(",")
    )];
    for row in rows {
        let Row { name, particles, threads, precision, median_seconds, min_seconds, rate, unit } = &row.row;
        let mut line = format!(
            "{name},{particles},{},{threads},{precision},{median_seconds},{min_seconds},{rate},{unit}",
            row.springs
        );
        for task in TASKS {
            line += ",";
            line += &row.tasks.get(task).map(f64::to_string).unwrap_or_default();
        }
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
    columns.extend(TASKS.map(Column::Right));
    columns.extend([Column::Right("frame"), Column::Left("Zara 2001, per frame")]);

    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let mut cells = vec![
                row.row.name.trim_start_matches("zara/").to_owned(),
                output::count(row.row.particles as u64),
                row.row.threads.to_string(),
            ];
            cells.extend(TASKS.map(|task| task_cell(row.tasks.get(task).copied())));
            cells.push(output::time(row.row.median_seconds));
            cells.push(paper_cell(&row.paper));
            cells
        })
        .collect();
    format!(
        "{}\n\nMedians; a frame is one step. Each task was timed by itself; in a step they are done together, in fewer sweeps over the\nparticles. An explicit step has no matrix and no solve. Stretch, shear and bend springs, {} iterations of the conjugate gradient\nfrom zero, {}. Of the paper's machines: a cluster of Pentium III at 733 MHz, and an SMP of four Pentium Pro at 200 MHz.",
        output::table(&columns, &cells),
        sheet::ITERATIONS,
        rows.first().map_or("f64", |row| row.row.precision),
    )
}

fn task_cell(seconds: Option<f64>) -> String {
    seconds.map_or_else(|| "-".to_owned(), output::time)
}

fn paper_cell(times: &[PublishedTime]) -> String {
    if times.is_empty() {
        return "-".to_owned();
    }
    let parts: Vec<_> =
        times.iter().map(|time| format!("{} s ({})", time.seconds, time.machine.label())).collect();
    parts.join(", ")
}

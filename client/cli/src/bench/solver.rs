//! `nappe bench solver`: linear solves of stiff sheets, wavy and rippled, with each preconditioner. To two tolerances, on one
//! thread and on all, straight on the simulation library.

use clap::Args;
use nappe_server::numbers::whole;
use nappe_sim::{
    cloth::Network,
    linalg::{AtCap, OperatorKind, Outcome, PreconditionerKind, SolverSettings, Stop},
    math::Precision,
    report::Stage,
};
use serde::Serialize;

use super::{
    row::{Row, thread_counts},
    sample, sheet,
    timings::{self, StepCounts, Timing},
};
use crate::words::{
    error::Result,
    output::{self, Column, Format, OutputArgs},
};

/// Stiff sheets, wavy and rippled: iterations and seconds of a solve, without and with coarse spaces, to two tolerances
#[derive(Args, Debug)]
pub(crate) struct SolverArgs {
    /// Particles along a side of each wavy sheet
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_values_t = [60, 120, 240], value_parser = whole::<u32>(8..=1000))]
    sides: Vec<u32>,
    /// Columns of each rippled sheet, which has 13/15 as many rows
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_values_t = [150], value_parser = whole::<u32>(8..=1000))]
    rippled: Vec<u32>,
    /// Relative residuals that solves go to
    #[arg(long, value_name = "T,...", value_delimiter = ',', default_values_t = [1e-3, 1e-8], value_parser = tolerance)]
    tolerances: Vec<f64>,
    /// Solves timed of each kind, on each number of threads
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = whole::<u32>(1..))]
    repetitions: u32,
    /// Threads of the second measurement [default: all cores]
    #[arg(long, value_name = "T", value_parser = whole::<u16>(1..))]
    threads: Option<u16>,
    #[command(flatten)]
    output: OutputArgs,
}

fn tolerance(text: &str) -> std::result::Result<f64, String> {
    let value: f64 = text.parse().map_err(|error| format!("{text:?} is not a number: {error}"))?;
    let is_allowed = value > 1e-15 && value < 1.0;
    is_allowed.then_some(value).ok_or_else(|| format!("{value} is not above 1e-15 and below 1"))
}

#[derive(Serialize)]
struct SolverRow {
    #[serde(flatten)]
    row: Row,
    /// Wavy or rippled.
    sheet: &'static str,
    /// Residual over that of a solution of 0, in the norm of the preconditioner.
    tolerance: f64,
    /// Median over solves.
    iterations: u32,
    /// Products with the matrix, those that compute a residual among them: median over solves.
    products: u32,
    /// Whether every solve met the tolerance.
    converged: bool,
}

/// Iterations after which a solve is given up.
const MAX_ITERATIONS: u32 = 20_000;

/// Runs `nappe bench solver`.
///
/// # Errors
/// When a run fails.
pub(crate) fn run(args: &SolverArgs) -> Result<()> {
    let mut rows = Vec::new();
    let wavy = args.sides.iter().map(|side| ("wavy", sheet::stiff(*side as usize)));
    let rippled = args.rippled.iter().map(|columns| ("rippled", sheet::rippled(*columns as usize)));
    for (sheet, network) in wavy.chain(rippled) {
        for precision in Precision::ALL {
            // A residual below the roundings of the precision is none.
            let least = if precision == Precision::F32 { 1e-6 } else { 0.0 };
            for tolerance in args.tolerances.iter().copied().filter(|tolerance| *tolerance >= least) {
                let particles = output::count(network.x.len() as u64);
                output::note(&format!("{sheet}, {particles} particles, {precision}, to {tolerance:e} ..."));
                for preconditioner in [
                    PreconditionerKind::BlockJacobi,
                    PreconditionerKind::TwoLevel,
                    PreconditionerKind::Patches,
                ] {
                    let kind = (precision, tolerance, preconditioner);
                    rows.extend(measure(args, (sheet, &network), kind)?);
                }
            }
        }
    }
    match args.output.format() {
        Format::Json => output::json(&rows),
        Format::Text => output::line(&text(&rows)),
    }
}

/// Precision, tolerance and preconditioner of solves.
type Kind = (Precision, f64, PreconditionerKind);

fn measure(
    args: &SolverArgs,
    (sheet, network): (&'static str, &Network),
    kind: Kind,
) -> Result<Vec<SolverRow>> {
    let (precision, tolerance, preconditioner) = kind;
    let solver = SolverSettings {
        stop: Stop::Residual { tolerance, max_iterations: MAX_ITERATIONS },
        preconditioner,
        at_cap: AtCap::Stop,
        operator: OperatorKind::MatrixFree,
        warm_start: false,
        floor: 0.0,
    };
    let setup = sheet::stiff_world(network, solver);
    let steps = StepCounts { warm_up: 1, timed: args.repetitions as usize };
    let timings = timings::measure(&setup, precision, &thread_counts(args.threads), steps)?;
    let row = |timing: &Timing| solver_row((sheet, network.x.len()), kind, timing);
    Ok(timings.iter().map(row).collect())
}

fn solver_row(
    (sheet, particles): (&'static str, usize),
    (precision, tolerance, preconditioner): Kind,
    timing: &Timing,
) -> SolverRow {
    let solve = Stage::ALL.iter().position(|stage| *stage == Stage::Solve).expect("ALL holds every stage");
    let seconds = || timing.samples.iter().map(|sample| sample.stages[solve]);
    let solves = || timing.samples.iter().filter_map(|sample| sample.solve);
    let median_seconds = sample::median(seconds());
    SolverRow {
        row: Row {
            name: format!("solver/{}", preconditioner.name()),
            particles,
            threads: timing.threads,
            precision: precision.name(),
            median_seconds,
            min_seconds: sample::minimum(seconds()),
            rate: 1.0 / median_seconds,
            unit: "solves/s",
        },
        sheet,
        tolerance,
        iterations: sample::median(solves().map(|solve| f64::from(solve.iterations))).round() as u32,
        products: sample::median(solves().map(|solve| f64::from(solve.products))).round() as u32,
        converged: solves().all(|solve| solve.outcome == Outcome::Converged),
    }
}

fn text(rows: &[SolverRow]) -> String {
    let columns = [
        Column::Left("sheet"),
        Column::Left("preconditioner"),
        Column::Right("particles"),
        Column::Left("precision"),
        Column::Right("tolerance"),
        Column::Right("threads"),
        Column::Right("iterations"),
        Column::Right("products"),
        Column::Right("median"),
        Column::Right("block_jacobi over it"),
    ];
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let slow = rows.iter().find(|other| {
                other.sheet == row.sheet
                    && other.row.particles == row.row.particles
                    && other.row.precision == row.row.precision
                    && other.row.threads == row.row.threads
                    && other.tolerance.to_bits() == row.tolerance.to_bits()
            });
            let ratio = slow.map_or(f64::NAN, |slow| slow.row.median_seconds / row.row.median_seconds);
            vec![
                row.sheet.to_owned(),
                row.row.name.trim_start_matches("solver/").to_owned(),
                output::count(row.row.particles as u64),
                row.row.precision.to_owned(),
                format!("{:e}", row.tolerance),
                row.row.threads.to_string(),
                format!("{}{}", row.iterations, if row.converged { "" } else { ", given up" }),
                row.products.to_string(),
                output::time(row.row.median_seconds),
                format!("{ratio:.1}"),
            ]
        })
        .collect();
    format!(
        "Solves of stiff cloth (dt 1/60 s), from zero; seconds of the solve, with the coarse matrix of two_level and with the set-up of \
         patches where that of a step before does not serve.\n\n{}",
        output::table(&columns, &cells)
    )
}

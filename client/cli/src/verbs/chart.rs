//! `nappe chart`: error against cost of every method, on a scene of the user's.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use clap::Args;
use nappe_scene::Scene;
use nappe_sim::math::Precision;
use nappe_study::{Case, Chart, Request, Times, TimesError, line_names};

use crate::{
    args::PrecisionName,
    chart::{self, words},
    error::{CliError, Exit, Result},
    output::{self, Format, OutputArgs},
    study::{self, Source, Subject, asked, files, units},
    write::ForceArgs,
};

/// Chart error against cost: every method, on a scene of cloth or snow
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe chart drap10                                a shipped scene, one minute, files in chart-drap10
  nappe chart my.toml --budget 10min --out study    a scene of your own, with more time for finer steps
  nappe chart flag --tolerance 0.1mm                to a tenth of a millimetre
  nappe chart flag --until 0.5 --precision f64      until a time, although it may lie beyond the predictability horizon
  nappe chart drap10 --method velocity_verlet,bdf2_newton --json
  nappe chart brasseur                              a scene of snow: every transfer and kernel on its cells and twice those

It finds the predictability horizon of the scene, computes a reference until then, and runs every method
at ever shorter steps within the budget. Of snow the reference has cells that are halved, with each particle split
into eight, for as long as the budget has time for it. Let the machine be idle: seconds are measured.

It writes chart.csv, a row per run, chart.json, and pictures: work_precision, convergence and window, each as
SVG and PNG. docs/charts.md says how to read them. With --json the last line is one object with their paths.")]
pub(crate) struct ChartArgs {
    /// A shipped scene's name, or a scene file (.toml) with its meshes beside it
    scene: String,
    /// Folder for the files [default: chart-SCENE]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Time that it may take: 60s, 10min
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = units::duration)]
    budget: Duration,
    /// Error of positions that matters: 1mm, 0.1mm
    #[arg(long, value_name = "LENGTH", default_value = "1mm", value_parser = units::length)]
    tolerance: f64,
    /// Compare until this time (s) [default: the predictability horizon]
    #[arg(long, value_name = "S", conflicts_with = "times")]
    until: Option<f64>,
    /// Compare at these times (s)
    #[arg(long, value_name = "S,...", value_delimiter = ',')]
    times: Vec<f64>,
    /// These methods alone, by their names in chart.csv
    #[arg(long = "method", value_name = "M,...", value_delimiter = ',')]
    methods: Vec<String>,
    /// One precision alone [default: both]
    #[arg(long, value_enum)]
    precision: Option<PrecisionName>,
    /// Threads [default: all cores]; results do not depend on them, seconds do
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe chart`.
///
/// # Errors
/// When the scene cannot be read or has neither cloth nor snow, an option asks for what does not exist, a file cannot be written, or the
/// user ends it: what was found is then written all the same.
pub(crate) fn run(args: &ChartArgs) -> Result<()> {
    let begin = Instant::now();
    let Source { name, hash: scene_hash, scene, case } = Source::read(&args.scene, "chart")?;
    let request = request(args, &scene, &case)?;
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("chart-{name}")));
    let folder = files::Folder::open(folder, &chart::FILES, args.force.existing())?;

    let threads = args.threads.map_or_else(rayon::current_num_threads, usize::from);
    let subject =
        Subject { name, scene_hash, processor: study::processor(), threads, budget: args.budget, begin };
    let chart = study::compute(threads, Some(subject.left()), move |budget, tell| {
        nappe_study::chart(&case, &request, budget, tell)
    })?;
    let written = chart::write(&folder, &subject, &chart)?;
    say(args.output.format(), &subject, &chart, &written)
}

/// What is asked for.
fn request(args: &ChartArgs, scene: &Scene, case: &Case) -> Result<Request> {
    let known = line_names(case);
    asked::check_methods(&args.methods, &known)?;
    let times = match args.until {
        Some(until) => Some(Times::until(until, scene.dt).map_err(|error| refused("--until", &error))?),
        None if args.times.is_empty() => None,
        None => Some(Times::at(&args.times, scene.dt).map_err(|error| refused("--times", &error))?),
    };
    if scene.steps == 0 && times.is_none() {
        return Err(CliError::usage("the scene has no end, steps = 0: say until when with --until S"));
    }
    Ok(Request {
        tolerance: args.tolerance,
        end: scene.steps as f64 * scene.dt,
        times,
        methods: args.methods.clone(),
        precisions: args.precision.map_or_else(|| Precision::ALL.to_vec(), |one| vec![one.into()]),
    })
}

fn refused(option: &str, error: &TimesError) -> CliError {
    CliError::usage(format!("{option}: {error}"))
}

fn say(format: Format, subject: &Subject, chart: &Chart, written: &[PathBuf]) -> Result<()> {
    match format {
        Format::Json => output::json(&serde_json::json!({
            "scene": subject.name,
            "rows": chart.rows.len(),
            "until_s": chart.until(),
            "cut": chart.is_cut,
            "interrupted": chart.is_stopped,
            "files": written,
        }))?,
        Format::Text => {
            if !chart.rows.is_empty() {
                output::line(&words::cheapest_rows(chart))?;
                output::line("")?;
            }
            output::line(&words::summary(chart))?;
            output::line(&files::told(written))?;
        }
    }
    if chart.is_stopped {
        return Err(CliError::new(Exit::Interrupted, "interrupted: what was found until then is written"));
    }
    Ok(())
}

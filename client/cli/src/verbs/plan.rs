//! `nappe plan`: the cheapest setting that is right enough, for a scene of the user's.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use clap::Args;
use nappe_scene::Scene;
use nappe_sim::math::Precision;
use nappe_study::{Case, Plan, Request, line_names};

use crate::{
    error::{CliError, Exit, Result},
    output::{self, Format, OutputArgs},
    plan::{self, scene::Terms, words},
    study::{self, LookArgs, Source, Subject, asked, files, units},
    write::{self, ForceArgs},
};

/// Find the cheapest method, step and precision that is right enough for a scene
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe plan drap10 --tolerance 1mm                 a shipped scene, one minute, files in plan-drap10
  nappe plan my.toml --tolerance 0.1mm --write planned.toml
  nappe plan flag --tolerance 1mm --method velocity_verlet,bdf2_absolute --json

It finds the predictability horizon of the scene, computes a reference until then, and shortens the steps of every
method in both precisions until one is right enough and the others would cost more. That one is run as a scene runs it,
over the whole time, and with half its step. Where nothing is right enough, it says what it would take.

It writes plan.csv, a row per run, plan.json, and a picture. docs/plan.md says what a plan promises. With --json the last line
is one object with the answer and their paths.")]
pub(crate) struct PlanArgs {
    /// A shipped scene's name, or a scene file (.toml) with its meshes beside it
    scene: String,
    /// Error of positions that is allowed: 1mm, 0.1mm; without a unit, metres
    #[arg(long, value_name = "LENGTH")]
    tolerance: String,
    /// Folder for the files [default: plan-SCENE]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Time that it may take: 60s, 10min
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = units::duration)]
    budget: Duration,
    /// Plan until this time (s) at most [default: the end of the scene]
    #[arg(long, value_name = "S")]
    until: Option<f64>,
    /// Among these methods alone, by their names in plan.csv
    #[arg(long = "method", value_name = "M,...", value_delimiter = ',')]
    methods: Vec<String>,
    /// Write the scene with the method, the steps and the precision of the plan
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Leave out of the scene that is written what it can do without
    #[arg(long, requires = "write")]
    leave_out: bool,
    /// Threads [default: all cores]; results do not depend on them, seconds do
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    #[command(flatten)]
    look: LookArgs,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe plan`.
///
/// # Errors
/// When the scene cannot be read or has neither cloth nor snow, an option asks for what does not exist, a file cannot be written,
/// or the user ends it. That nothing is right enough is an answer, and no error.
pub(crate) fn run(args: &PlanArgs) -> Result<()> {
    let begin = Instant::now();
    let Source { name, hash: scene_hash, scene, case } = Source::read(&args.scene, "plan")?;
    let request = request(args, &scene, &case)?;
    check_written(args, &case)?;
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("plan-{name}")));
    let folder = files::Folder::open(folder, &plan::FILES, args.force.existing())?;

    let threads = args.threads.map_or_else(rayon::current_num_threads, usize::from);
    let processor = study::processor();
    let subject = Subject { name, scene_hash, processor, threads, budget: args.budget, begin };
    let found = study::compute(threads, Some(subject.left()), move |budget, tell| {
        nappe_study::plan(&case, &request, budget, tell)
    })?;
    let mut written = plan::write(&folder, &subject, &found, &args.look)?;
    if let Some(path) = &args.write {
        let terms = if args.leave_out { Terms::LeftOut } else { Terms::Kept };
        match plan::scene_text(&subject.name, &scene, &found, terms) {
            Some(text) => {
                write::write_whole(path, text.as_bytes(), args.force.existing())?;
                written.push(path.clone());
            }
            None => output::note("no scene is written: nothing that was tried is right enough"),
        }
    }
    say(args.output.format(), &subject, &found, &written)
}

/// Refuses a file that would be lost, and a scene of snow, whose plan is its cells.
fn check_written(args: &PlanArgs, case: &Case) -> Result<()> {
    let Some(path) = &args.write else { return Ok(()) };
    write::check(path, args.force.existing())
        .map_err(|error| CliError::usage(format!("--write {}", error.message)))?;
    if case.is_snow() {
        return Err(CliError::usage("--write: plans of snow are not written as scenes yet"));
    }
    Ok(())
}

/// What is asked for.
fn request(args: &PlanArgs, scene: &Scene, case: &Case) -> Result<Request> {
    let tolerance =
        units::length(&args.tolerance).map_err(|error| CliError::usage(format!("--tolerance: {error}")))?;
    if args.tolerance.trim().parse::<f64>().is_ok() {
        output::note(&format!("--tolerance {}: without a unit it is metres", args.tolerance));
    }
    let known = line_names(case);
    asked::check_methods(&args.methods, &known)?;
    let end = asked::end(args.until, scene)?;
    let (methods, precisions) = (args.methods.clone(), Precision::ALL.to_vec());
    Ok(Request { tolerance, end, times: None, methods, precisions })
}

fn say(format: Format, subject: &Subject, plan: &Plan, written: &[PathBuf]) -> Result<()> {
    match format {
        Format::Json => output::json(&plan::said(subject, plan, written))?,
        Format::Text => {
            output::line(&words::answer(plan))?;
            if !plan.tried.is_empty() {
                output::line("")?;
                output::line(&words::tried(plan))?;
            }
            if !plan.terms.is_empty() {
                output::line("")?;
                output::line(&words::terms(plan))?;
                output::line("")?;
            }
            output::line(&files::told(written))?;
        }
    }
    if plan.chart.is_stopped {
        return Err(CliError::new(Exit::Interrupted, "interrupted: what was found until then is written"));
    }
    Ok(())
}

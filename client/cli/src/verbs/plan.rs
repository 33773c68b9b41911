//! `nappe plan`: the cheapest setting that is accurate enough, for a scene of the user's.

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use clap::Args;
use nappe_scene::{Scene, files::Folder as Meshes};
use nappe_server::numbers::{Least, SECONDS, real, whole};
use nappe_sim::math::Precision;
use nappe_study::{
    Budget, Case, Effort, Measure, Plan, Request, SceneTerms, Stepped, Terms, TimesError, line_names,
};

use crate::{
    files::write::{self, ForceArgs},
    studies::{
        plan::{self, scene, terms, words},
        study::{self, CoarserCopy, Folder, LookArgs, Source, Subject, asked, files, measure, units},
    },
    words::{
        error::{CliError, Result},
        output::{self, Format, OutputArgs},
    },
};

/// Find the cheapest method that is accurate enough for a scene
///
/// A method is an integrator with its step, its solver and its precision.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe plan drap10 --tolerance 1mm                 a shipped scene, one minute, files in plan-drap10
  nappe plan my.toml --tolerance 0.1mm --write planned.toml
  nappe plan flag --tolerance 1mm --method velocity_verlet,bdf2_absolute --json
  nappe plan my.toml --tolerance 1mm --measure end  where it hangs or lies at its end, although its motion cannot be predicted

It finds the predictability horizon of the scene, computes a reference until then, and shortens the steps of every
method in both precisions until one is accurate enough at every step of the scene and the others would cost more. That one
is run with half its step, and as a scene to the end of the scene. Where nothing is accurate enough, it says what it would
take. Of snow it makes the chart of `nappe chart` and takes the cheapest row on the scene's cells.

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
    /// Class of effort of the reference, 0 to 9: each takes four times the work of the one before, and what it finds does not depend on
    /// the machine [default: the largest that the budget can pay]
    #[arg(long, value_name = "N", value_parser = asked::effort)]
    effort: Option<Effort>,
    /// What is to be accurate: motion, end, energy, sag, or particle.NAME.y; all but motion over the whole scene
    #[arg(long, value_name = "WHAT", default_value = "motion")]
    measure: String,
    /// Plan until this time (s) at most [default: the end of the scene]
    #[arg(long, value_name = "S", value_parser = real(SECONDS, Least::Above0))]
    until: Option<f64>,
    /// Among these methods alone, by their names in plan.csv
    #[arg(long = "method", value_name = "M,...", value_delimiter = ',')]
    methods: Vec<String>,
    /// Write the scene with the method, the steps and the precision of the plan, as far as it was run so
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Leave out of the scene that is written what it can do without
    #[arg(long, requires = "write")]
    leave_out: bool,
    /// Threads [default: all cores]; results do not depend on them, seconds do
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..))]
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
/// or the user ends it. That nothing is accurate enough is an answer, and no error.
pub(crate) fn run(args: &PlanArgs) -> Result<()> {
    let begin = Instant::now();
    let source = Source::read(&args.scene, "plan")?;
    let source = Source { case: measure::measuring(&args.measure, source.case)?, ..source };
    let mut subject = source.subject(args.threads, args.budget, begin);
    let (name, scene) = (source.name.clone(), source.scene.clone());
    let request = request(args, &scene, &source.case)?;
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("plan-{name}")));
    check_written(args, &folder)?;
    let folder = Folder::open(folder, &plan::FILES, args.force.existing())?;

    let wanted = if args.leave_out { Terms::LeftOut } else { Terms::Kept };
    let meshes = Source::meshes(&args.scene);
    let (found, instead) = study::compute(subject.threads, Some(subject.left()), move |budget, tell| {
        let of_source = |source: &Source| planned((source, &meshes), &request, wanted, (budget, tell));
        study::fitted(&source, &meshes, &of_source, |plan: &Plan| study::unfit(&plan.chart))
    })?;
    if let Some(instead) = &instead {
        instead.take_over(&mut subject);
    }
    let scene = instead.map_or(scene, |instead| instead.source.scene);
    let mut written = plan::write(&folder, &subject, &found, &args.look)?;
    if let Some(path) = &args.write {
        if !subject.is_whole {
            output::note(
                "the scene that is written has its snow too, which no plan looks at: only its cloths are as planned",
            );
        }
        match plan::scene_text(&name, &scene, &found) {
            Some(text) => {
                let why = subject.instead.as_ref().map_or_else(String::new, |why| format!("# {why}\n"));
                let text = why + &text;
                write::write_whole(path, text.as_bytes(), args.force.existing())?;
                written.push(path.clone());
            }
            None => output::note("no scene is written: nothing is recommended"),
        }
    }
    say(args.output.format(), &subject, &found, &written)
}

/// Plans a scene, whose meshes are beside it, with its terms: the last is that of a coarser copy, where it has one.
fn planned(
    (source, meshes): (&Source, &Meshes),
    request: &Request,
    wanted: Terms,
    (budget, tell): (&Budget, &dyn Fn(&str)),
) -> Plan {
    let Source { name, scene, case, .. } = source;
    let copy = CoarserCopy::of(source, CoarserCopy::BY, meshes).ok();
    let names = |stepped: &Stepped| scene::term_names(scene, stepped, copy.as_ref());
    let without =
        |stepped: &Stepped, places: &[usize]| scene::case_without((name, scene, meshes), stepped, places);
    let grids = copy.as_ref().map_or_else(Vec::new, |copy| copy.grids.clone());
    let terms = SceneTerms { names: &names, without: &without, grids: &grids, wanted };
    nappe_study::plan(case, request, &terms, budget, tell)
}

/// Refuses a file that would be lost, and one that cannot be written; the folder of the other files will be there.
fn check_written(args: &PlanArgs, out: &Path) -> Result<()> {
    let Some(path) = &args.write else { return Ok(()) };
    if path.is_dir() || path == out {
        let what = format!("--write {}: is a folder; the name of a file is needed", path.display());
        return Err(CliError::usage(what));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|folder| !folder.is_dir() && *folder != out) {
        let (path, folder) = (path.display(), folder.display());
        let what =
            format!("--write {path}: there is no folder {folder}; make it first, or name another file");
        return Err(CliError::usage(what));
    }
    write::check(path, args.force.existing())
        .map_err(|error| CliError::usage(format!("--write {}", error.message)))
}

/// What is asked for.
fn request(args: &PlanArgs, scene: &Scene, case: &Case) -> Result<Request> {
    let tolerance = asked::tolerance(&args.tolerance, case)?;
    if args.tolerance.trim().parse::<f64>().is_ok() {
        output::note(&format!("--tolerance {}: without a unit it is metres", args.tolerance));
    }
    let known = line_names(case);
    asked::check_methods(&args.methods, &known)?;
    let end = asked::end(args.until, scene)?;
    // A scene is over at its end, whatever is asked for.
    let end = if scene.steps > 0 { end.min(scene.steps as f64 * scene.dt) } else { end };
    let (methods, precisions) = (args.methods.clone(), Precision::ALL.to_vec());
    let (scene_steps, effort) = (scene.steps, args.effort);
    let times = match case.measure() {
        Measure::Motion => None,
        measure => Some(measure.times(end, scene.dt).map_err(|error| refused(&error))?),
    };
    Ok(Request { tolerance, end, scene_steps, times, methods, precisions, effort })
}

fn refused(error: &TimesError) -> CliError {
    CliError::usage(format!("--until: {error}"))
}

fn say(format: Format, subject: &Subject, plan: &Plan, written: &[PathBuf]) -> Result<()> {
    let mut text = words::answer(plan);
    if !plan.tried.is_empty() {
        text = format!("{text}\n\n{}", words::tried(plan));
    }
    if !plan.terms.is_empty() {
        text = format!("{text}\n\n{}\n", terms::terms(plan));
    }
    files::say(format, &plan::said(subject, plan, written), &subject.said(&text), written)?;
    if plan.chart.is_stopped { Err(study::interrupted()) } else { Ok(()) }
}

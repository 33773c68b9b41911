//! `nappe chart`: error against cost of every method, on a scene of the user's.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use clap::Args;
use nappe_scene::{Scene, files::Folder as Meshes};
use nappe_server::numbers::{Least, SECONDS, real, whole};
use nappe_sim::math::Precision;
use nappe_study::{Case, Chart, Effort, Measure, Request, Times, TimesError, add_coarser, line_names};

use crate::{
    files::write::ForceArgs,
    options::args::PrecisionName,
    studies::{
        chart::{
            self,
            several::{self, Charted},
            words,
        },
        study::{
            self, CoarserCopy, Folder, HASH_OF, LookArgs, Source, Subject, asked, files, measure, units,
        },
    },
    words::{
        error::{CliError, Exit, Result},
        output::{Format, OutputArgs},
    },
};

/// Chart error against cost: every method, on scenes of cloth or snow
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe chart drap10                                a shipped scene, one minute, files in chart-drap10
  nappe chart my.toml --budget 10min --out study    a scene of your own, with more time for finer steps
  nappe chart flag --tolerance 0.1mm                to a tenth of a millimetre
  nappe chart flag --until 0.5 --precision f64      until a time, although it may lie beyond the predictability horizon
  nappe chart flag --effort 2 --budget 10min        with a smaller reference, the same on any machine
  nappe chart my.toml --measure end                 where it hangs or lies at its end, although its motion cannot be predicted
  nappe chart drap10 --method velocity_verlet,bdf2_newton --json
  nappe chart brasseur                              a scene of snow: every transfer and kernel on its cells and twice those
  nappe chart drap10 flag hanging_sheet --out study a chart of each, and on what share of them each method is the cheapest
  nappe chart flag --coarser                        and how far off a copy with a quarter of the particles is
  nappe chart drap10 --width 85 --no-caption        pictures for a column of a journal

It finds the predictability horizon of the scene, computes a reference until then, and runs every method
at ever shorter steps within the budget. Of snow the reference has cells that are halved, with each particle split
into eight. How much work the reference takes is its effort, which the budget pays: the chart says it, and --effort asks for it.
Let the machine be idle: seconds are measured.

It writes chart.csv, a row per run, chart.json, and pictures: work_precision, convergence and window, each as
SVG and PNG. docs/charts.md says how to read them. With --json the last line is one object with their paths.

Of several scenes each has a budget of its own and a folder of its name, and a performance profile is written beside
these: profile.csv, profile.json and a picture.")]
pub(crate) struct ChartArgs {
    /// Shipped scenes' names, or scene files (.toml) with their meshes beside them; of several a profile is made too
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<String>,
    /// Folder for the files [default: chart-SCENE, of several chart-profile]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Time that each scene may take: 60s, 10min
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = units::duration)]
    budget: Duration,
    /// Class of effort of the reference, 0 to 9: each takes four times the work of the one before, and what it finds does not depend on
    /// the machine [default: the largest that the budget can pay]
    #[arg(long, value_name = "N", value_parser = asked::effort)]
    effort: Option<Effort>,
    /// Error of positions that matters: 1mm, 0.1mm
    #[arg(long, value_name = "LENGTH", default_value = "1mm")]
    tolerance: String,
    /// What is compared: motion, end, energy, sag, or particle.NAME.y; all but motion over the whole scene
    #[arg(long, value_name = "WHAT", default_value = "motion")]
    measure: String,
    /// Compare until this time (s) [default: the predictability horizon]
    #[arg(long, value_name = "S", conflicts_with = "times", value_parser = real(SECONDS, Least::Above0))]
    until: Option<f64>,
    /// Compare at these times (s)
    #[arg(long, value_name = "S,...", value_delimiter = ',', value_parser = real(SECONDS, Least::Above0))]
    times: Vec<f64>,
    /// These methods alone, by their names in chart.csv
    #[arg(long = "method", value_name = "M,...", value_delimiter = ',')]
    methods: Vec<String>,
    /// One precision alone [default: both]
    #[arg(long, value_enum)]
    precision: Option<PrecisionName>,
    /// Run the best settings on a copy of the scene too, whose particles are N times as far apart; without a number 2
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "2", value_parser = whole::<u32>(2..=100_000))]
    coarser: Option<u32>,
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

/// A scene, and what is asked of its chart.
struct Asked {
    source: Source,
    request: Request,
    copy: Option<CoarserCopy>,
    /// Where the meshes of the scene are.
    meshes: Meshes,
}

/// Share of the budget that a chart has where a coarser copy has the rest.
const OF_SCENE: f64 = 0.8;

/// Runs `nappe chart`.
///
/// # Errors
/// When a scene cannot be read or has neither cloth nor snow, an option asks for what does not exist, a file cannot be written, or the
/// user ends it: what was found is then written all the same.
pub(crate) fn run(args: &ChartArgs) -> Result<()> {
    match args.scenes.as_slice() {
        [scene] => run_one(args, scene),
        scenes => run_several(args, scenes),
    }
}

fn run_one(args: &ChartArgs, scene: &str) -> Result<()> {
    let begin = Instant::now();
    let asked = read(args, scene)?;
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("chart-{}", asked.source.name)));
    let folder = Folder::open(folder, &chart::FILES, args.force.existing())?;
    let (subject, chart) = compute(args, asked, begin)?;
    let written = chart::write(&folder, &subject, &chart, &args.look)?;
    say(args.output.format(), &subject, &chart, &written)
}

/// A chart of each scene in a folder of its name, and the profile of all.
fn run_several(args: &ChartArgs, scenes: &[String]) -> Result<()> {
    let named = |scene: &String| {
        let said = |error: CliError| CliError { message: format!("{scene}: {}", error.message), ..error };
        read(args, scene).map_err(said)
    };
    let asked = scenes.iter().map(named).collect::<Result<Vec<_>>>()?;
    check_together(&asked)?;
    // All have the same.
    let tolerance = asked.first().map_or(0.0, |one| one.request.tolerance);
    let existing = args.force.existing();
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from("chart-profile"));
    let folder = Folder::open(out.clone(), &several::FILES, existing)?;
    let of_scene = |one: &Asked| Folder::open(out.join(&one.source.name), &chart::FILES, existing);
    let folders = asked.iter().map(of_scene).collect::<Result<Vec<_>>>()?;

    let (mut charts, mut written, mut is_stopped) = (Vec::new(), Vec::new(), false);
    for (one, folder) in asked.into_iter().zip(&folders) {
        let (subject, chart) = compute(args, one, Instant::now())?;
        written.extend(chart::write(folder, &subject, &chart, &args.look)?);
        is_stopped = chart.is_stopped;
        charts.push(Charted::new(subject, &chart));
        if is_stopped {
            break;
        }
    }
    let profile = several::profile(&charts, tolerance);
    if !is_stopped {
        written.extend(several::write(&folder, &charts, &profile, &args.look)?);
    }
    let words = if is_stopped { String::new() } else { several::text(&profile) };
    files::say(args.output.format(), &several::said(&charts, &profile, &written), &words, &written)?;
    if is_stopped {
        let message = "interrupted: the charts that were made until then are written, and no profile of them";
        return Err(CliError::new(Exit::Interrupted, message));
    }
    Ok(())
}

/// Reads a scene, and what is asked of it.
fn read(args: &ChartArgs, scene: &str) -> Result<Asked> {
    let source = Source::read(scene, "chart")?;
    let source = Source { case: measure::measuring(&args.measure, source.case)?, ..source };
    let request = request(args, &source.scene, &source.case)?;
    let meshes = Source::meshes(scene);
    let copy = |by: u32| {
        CoarserCopy::of(&source, by, &meshes).map_err(|error| CliError::usage(format!("--coarser: {error}")))
    };
    let copy = args.coarser.map(copy).transpose()?;
    Ok(Asked { source, request, copy, meshes })
}

/// Refuses scenes whose charts would be written into one folder, and cloth beside snow, which have no method in common.
fn check_together(asked: &[Asked]) -> Result<()> {
    for (place, one) in asked.iter().enumerate() {
        let name = &one.source.name;
        if asked[..place].iter().any(|other| other.source.name == *name) {
            return Err(CliError::usage(format!(
                "two scenes are called {name}, and the chart of each goes into a folder of its name: rename one of the files"
            )));
        }
    }
    let (snow, cloth): (Vec<_>, Vec<_>) = asked.iter().partition(|one| one.source.case.is_snow());
    if let (Some(snow), Some(cloth)) = (snow.first(), cloth.first()) {
        return Err(CliError::usage(format!(
            "{} is snow and {} is cloth, which have no method in common: chart them apart",
            snow.source.name, cloth.source.name
        )));
    }
    Ok(())
}

/// Computes the chart of a scene, whose budget began then.
fn compute(args: &ChartArgs, asked: Asked, begin: Instant) -> Result<(Subject, Chart)> {
    let Asked { source, request, copy, meshes } = asked;
    let mut subject = source.subject(args.threads, args.budget, begin);
    let share = if copy.is_some() { OF_SCENE } else { 1.0 };
    let left = subject.left().mul_f64(share);
    let (chart, instead) = study::compute(subject.threads, Some(left), move |budget, tell| {
        let of_source = |source: &Source| {
            let Source { name, case, .. } = source;
            nappe_study::chart(case, &request, budget, &|what| tell(&format!("{name}: {what}")))
        };
        let (mut chart, instead) = study::fitted(&source, &meshes, &of_source, study::unfit);
        if let (Some(copy), None) = (&copy, &instead) {
            add_coarser(&mut chart, &copy.coarser, &budget.until(OF_SCENE.recip()), tell);
        }
        (chart, instead)
    })?;
    if let Some(instead) = instead {
        instead.take_over(&mut subject);
    }
    Ok((subject, chart))
}

/// What is asked for.
fn request(args: &ChartArgs, scene: &Scene, case: &Case) -> Result<Request> {
    let known = line_names(case);
    asked::check_methods(&args.methods, &known)?;
    let times = times(args, scene, case.measure())?;
    if scene.steps == 0 && times.is_none() {
        return Err(CliError::usage("the scene has no end, steps = 0: say until when with --until S"));
    }
    Ok(Request {
        tolerance: asked::tolerance(&args.tolerance, case)?,
        end: scene.steps as f64 * scene.dt,
        scene_steps: scene.steps,
        times,
        methods: args.methods.clone(),
        precisions: args.precision.map_or_else(|| Precision::ALL.to_vec(), |one| vec![one.into()]),
        effort: args.effort,
    })
}

/// The times at which runs are compared, where they are no window.
fn times(args: &ChartArgs, scene: &Scene, measure: &Measure) -> Result<Option<Times>> {
    if !args.times.is_empty() {
        if *measure == Measure::End {
            return Err(CliError::usage(
                "--times: with --measure end runs are compared at one time, that of --until or the end of the scene",
            ));
        }
        return Times::at(&args.times, scene.dt).map(Some).map_err(|error| refused("--times", &error));
    }
    let whole = scene.steps as f64 * scene.dt;
    let end = args.until.or((*measure != Measure::Motion && whole > 0.0).then_some(whole));
    let times = end.map(|end| measure.times(end, scene.dt));
    times.transpose().map_err(|error| refused("--until", &error))
}

fn refused(option: &str, error: &TimesError) -> CliError {
    CliError::usage(format!("{option}: {error}"))
}

fn say(format: Format, subject: &Subject, chart: &Chart, written: &[PathBuf]) -> Result<()> {
    let json = serde_json::json!({
        "scene": subject.name,
        "scene_hash": subject.scene_hash,
        "hash_of": HASH_OF,
        "rows": chart.rows.len(),
        "until_s": chart.until(),
        "compared": chart::document::compared(chart),
        "effort": chart.effort.map(Effort::class),
        "cut": chart.is_cut,
        "interrupted": chart.is_stopped,
        "files": written,
    });
    let mut text = words::summary(chart);
    if !chart.rows.is_empty() {
        text = format!("{}\n\n{text}", words::cheapest_rows(chart));
    }
    files::say(format, &json, &subject.said(&text), written)?;
    if chart.is_stopped { Err(study::interrupted()) } else { Ok(()) }
}

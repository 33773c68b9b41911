//! `nappe stability`: where every method fails, on a scene of the user's.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use clap::{Args, ValueEnum};
use nappe_scene::Scene;
use nappe_server::numbers::{Least, SECONDS, real, whole};
use nappe_study::{Case, Effort, Map, Method, Stability, StabilityRequest};

use crate::{
    files::write::ForceArgs,
    studies::{
        stability::{self, gallery, words},
        study::{self, Folder, LookArgs, Source, Subject, asked, files, units},
    },
    words::{
        error::{CliError, Exit, Result},
        output::{self, Format, OutputArgs},
    },
};

/// Find where every method fails, on a scene of cloth
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe stability drap10                            a shipped scene, one minute, files in stability-drap10
  nappe stability my.toml --budget 10min --out study
  nappe stability flag --method velocity_verlet,implicit_euler_absolute --map damping
  nappe stability drap10 --map compression --cells 12 --json
  nappe stability --gallery                         scenes in which programs of this kind fail, over every method

Of each method it finds the longest stable step, of small motions at rest beside what theory says, and of the scene
itself beside the certified bound; then what becomes of it as the program runs it, and maps of steps against
damping and against how far the start is pressed together.

It writes stability.csv, a row per run, stability.json, and pictures: limits, map_damping and map_compression, each
as SVG and PNG; of the gallery, gallery.csv and a picture. docs/stability.md says how to read them. With --json the last line is one object with their paths.")]
pub(crate) struct StabilityArgs {
    /// A shipped scene's name, or a scene file (.toml) with its meshes beside it
    #[arg(required_unless_present = "gallery")]
    scene: Option<String>,
    /// The gallery instead of a scene: scenes in which programs of this kind fail, over every method
    #[arg(long, conflicts_with_all = ["scene", "budget", "effort", "tolerance", "until", "methods", "maps", "cells"])]
    gallery: bool,
    /// Folder for the files [default: stability-SCENE, stability-gallery]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Time that it may take: 60s, 10min
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = units::duration)]
    budget: Duration,
    /// Class of effort of the reference, 0 to 9: each takes four times the work of the one before, and what it finds does not depend on
    /// the machine [default: the largest that the budget can pay]
    #[arg(long, value_name = "N", value_parser = asked::effort)]
    effort: Option<Effort>,
    /// Error of positions that matters: a stable run is wrong beyond ten times it
    #[arg(long, value_name = "LENGTH", default_value = "1mm")]
    tolerance: String,
    /// Judge runs until this time (s) at most [default: the end of the scene]
    #[arg(long, value_name = "S", value_parser = real(SECONDS, Least::Above0))]
    until: Option<f64>,
    /// These methods alone, by their names in stability.csv
    #[arg(long = "method", value_name = "M,...", value_delimiter = ',')]
    methods: Vec<String>,
    /// These maps alone [default: both]
    #[arg(long = "map", value_name = "MAP,...", value_delimiter = ',')]
    maps: Vec<MapName>,
    /// Cells along each side of a map, at most
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = whole::<u16>(2..=64))]
    cells: u16,
    /// Threads [default: all cores]; results do not depend on them
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..))]
    threads: Option<u16>,
    #[command(flatten)]
    look: LookArgs,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// What is mapped against the length of steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MapName {
    /// The damping of everything elastic
    Damping,
    /// How far the start is pressed together
    Compression,
}

impl From<MapName> for Map {
    fn from(name: MapName) -> Self {
        match name {
            MapName::Damping => Self::Damping,
            MapName::Compression => Self::Compression,
        }
    }
}

/// Runs `nappe stability`.
///
/// # Errors
/// When the scene cannot be read, has no cloth or nothing that moves, an option asks for what does not exist, a file cannot be
/// written, or the user ends it: what was found is then written all the same.
pub(crate) fn run(args: &StabilityArgs) -> Result<()> {
    let begin = Instant::now();
    let Some(scene) = &args.scene else { return run_gallery(args) };
    let source = Source::read(scene, "stability")?;
    let subject = source.subject(args.threads, args.budget, begin);
    let Source { name, scene, case, .. } = source;
    let request = request(args, &scene, &case)?;
    check(&case, args)?;
    let request = StabilityRequest { maps: maps(&case, args), ..request };
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("stability-{name}")));
    let folder = Folder::open(folder, &stability::FILES, args.force.existing())?;

    let found = study::compute(subject.threads, Some(subject.left()), move |budget, tell| {
        nappe_study::stability(&case, &request, budget, tell)
    })?;
    let written = stability::write(&folder, &subject, &found, &args.look)?;
    say(args.output.format(), &subject, &found, &written)
}

/// Every scene of the gallery over every method.
fn run_gallery(args: &StabilityArgs) -> Result<()> {
    if let Some(width) = args.look.width().filter(|width| *width < gallery::LEAST_WIDTH) {
        return Err(CliError::usage(format!(
            "--width {width}: the gallery has a column per method beside the names of its scenes; from {} mm on its words are \
             legible",
            gallery::LEAST_WIDTH
        )));
    }
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("stability-gallery"));
    let folder = Folder::open(folder, &gallery::FILES, args.force.existing())?;
    let (tables, is_stopped) = study::compute(study::threads(args.threads), None, |budget, tell| {
        let tables = nappe_study::gallery::gallery(budget, tell);
        (tables, budget.is_stopped())
    })?;
    if is_stopped {
        return Err(CliError::new(Exit::Interrupted, "interrupted: nothing is written"));
    }
    let written = gallery::write(&folder, &tables, &args.look)?;
    let json = gallery::document(&tables, &written);
    files::say(args.output.format(), &json, &gallery::text(&tables), &written)
}

/// What is asked for, but for maps.
fn request(args: &StabilityArgs, scene: &Scene, case: &Case) -> Result<StabilityRequest> {
    let known: Vec<String> = Method::studied().into_iter().map(Method::name).collect();
    asked::check_methods(&args.methods, &known)?;
    let end = asked::end(args.until, scene)?;
    Ok(StabilityRequest {
        tolerance: asked::tolerance(&args.tolerance, case)?,
        end,
        methods: args.methods.clone(),
        maps: Vec::new(),
        cells: args.cells.into(),
        effort: args.effort,
    })
}

/// Refuses a scene without cloth, one in which nothing can move, and maps that it cannot have.
fn check(case: &Case, args: &StabilityArgs) -> Result<()> {
    if case.is_snow() {
        return Err(CliError::failure(format!(
            "{} has no cloth; methods of cloth are studied, of snow see --gallery",
            case.name
        )));
    }
    if !case.can_move() {
        return Err(CliError::failure(format!(
            "nothing can move in {}: every particle is pinned",
            case.name
        )));
    }
    for map in &args.maps {
        if let Some(why) = impossible(case, *map) {
            let name = Map::from(*map).name();
            return Err(CliError::usage(format!("--map {name}: {why}")));
        }
    }
    Ok(())
}

/// Why a scene cannot have a map.
fn impossible(case: &Case, map: MapName) -> Option<&'static str> {
    match map {
        MapName::Damping if !case.has_springs() => Some("the scene has no springs to be damped"),
        MapName::Compression if case.extents().iter().all(|extent| *extent == 0.0) => {
            Some("the scene is a single point, which nothing can press together")
        }
        MapName::Damping | MapName::Compression => None,
    }
}

/// The maps that are asked for, or all that the scene can have.
fn maps(case: &Case, args: &StabilityArgs) -> Vec<Map> {
    let all = if args.maps.is_empty() { MapName::value_variants() } else { &args.maps };
    let mut maps: Vec<Map> = Vec::new();
    for map in all.iter().filter(|map| impossible(case, **map).is_none()) {
        if !maps.contains(&Map::from(*map)) {
            maps.push((*map).into());
        }
    }
    if maps.contains(&Map::Damping) && case.damping_axis() == nappe_study::Across::DampingRatio {
        output::note(
            "no spring is damped: the map varies the damping as a share of what is critical for the fastest mode",
        );
    }
    maps
}

fn say(format: Format, subject: &Subject, study: &Stability, written: &[PathBuf]) -> Result<()> {
    let json = serde_json::json!({
        "scene": subject.name,
        "rows": study.rows.len(),
        "effort": study.effort.map(Effort::class),
        "lost": study.lost().count(),
        "cut": study.is_cut,
        "interrupted": study.is_stopped,
        "files": written,
    });
    let text = format!("{}\n\n{}", words::limits(study), words::summary(study));
    files::say(format, &json, &text, written)?;
    if study.is_stopped { Err(study::interrupted()) } else { Ok(()) }
}

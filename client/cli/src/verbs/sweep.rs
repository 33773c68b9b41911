//! `nappe sweep`: one scene with other values, side by side.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use nappe_scene::Scene;
use nappe_server::numbers::{Least, SECONDS, real, whole};
use serde_json::{Value, json};
use xxhash_rust::xxh3::xxh3_64;

use crate::{
    files::write::{self, Existing, ForceArgs},
    studies::{
        study::{self, Source, files},
        sweep::{
            Columns, Common, Description, End, Measure, Meshes, Part, Parts, Set, Sweep, Table,
            check_distinct, combinations, folder_of, lock, named, named_by_any, picture_files,
        },
    },
    words::{
        error::{CliError, Exit, Result},
        output::{self, Format, OutputArgs},
    },
};

/// Run a scene with other values of its keys, a row per run
///
/// Runs are computed side by side.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe sweep flag --set body.flag.springs.bend.stiffness=1,5,20 --set wind.0=2,4 --out study
  nappe sweep my.toml --set body.cloth.drag=0.001..0.1 --sample 50 --seed 1 --out study --save
  nappe sweep my.toml --set dt=0.01,0.005 --until 2 --measure body.cloth.lowest,body.cloth.particle.17.y --out study
  nappe sweep flag --set 'wind=[1,0,0],[4,0,0]' --set body.flag.integrator=bdf2,implicit_euler --out study

Keys are those of the scene file with a dot between them, bodies, objects and colliders by their names, numbers of a list by
their places from 0 on. A list in brackets takes the place of a list, a table in braces that of a table. Values go through the
schema before anything runs, and meshes are read once, at the start.

Measures are taken at the end of each run: of a body NAME, body.NAME.lowest and .highest (y, m), .centre.x, .y and .z (of mass, m),
.fastest (m/s), .particle.N.x, .y and .z (m, N from 0 on, or a name: top_left); the same of an object of snow, snow.NAME.lowest and so on;
the force on a collider NAME, collider.NAME.force.x, .y and .z (N, in the last step), .force.mean and .force.greatest (its size, N, over
all steps).

It writes sweep.csv, one row per run, appended as runs end and sorted when all are done; sweep.json, what was asked for; and with
one key or two a picture, sweep.svg and sweep.png. An interrupted sweep resumes when it is started again with the same arguments,
scene and meshes; with --force it begins anew. With --json the last line is one object with the paths.

Jobs of a cluster compute parts of it, each in a folder of its own: --part 3/20 takes the third of twenty, whose rows have the
numbers that they have in the whole sweep. `nappe sweep join part-* --out study` puts the parts together.")]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    disable_help_subcommand = true
)]
pub(crate) struct SweepArgs {
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    runs: Option<RunsArgs>,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Subcommand, Debug)]
enum Action {
    /// Put parts of a sweep together that --part computed
    Join(JoinArgs),
}

#[derive(Args, Debug)]
struct JoinArgs {
    /// Folders of the parts, each that of its --out
    #[arg(value_name = "DIR", required = true)]
    parts: Vec<PathBuf>,
    /// Folder for the files of the whole sweep
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Args, Debug)]
struct RunsArgs {
    /// A shipped scene's name, or a scene file (.toml) with its meshes beside it
    scene: String,
    /// A key, and the values that it takes, or with --sample their range
    #[arg(long = "set", value_name = "KEY=V,V,...", required = true, value_parser = Set::parse)]
    sets: Vec<Set>,
    /// Folder for the files
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// So many combinations at random, in place of every one
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=100_000))]
    sample: Option<u32>,
    /// Where samples come from
    #[arg(long, value_name = "N", default_value_t = 1, requires = "sample", value_parser = whole::<u64>(0..))]
    seed: u64,
    /// Steps of each run [default: to the end of the scene; its time where dt is a key, each run's own steps where steps is]
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..))]
    steps: Option<u64>,
    /// Run until this time (s), whatever the step of each run; runs whose step does not divide it are refused
    #[arg(long, value_name = "S", conflicts_with = "steps", value_parser = real(SECONDS, Least::Above0))]
    until: Option<f64>,
    /// What is measured of each run, a column each: body.NAME.lowest, snow.NAME.centre.x, collider.NAME.force.y, ...
    #[arg(long = "measure", value_name = "MEASURE,...", value_delimiter = ',', value_parser = Measure::parse)]
    measures: Vec<Measure>,
    /// One part of the runs, the Kth of N, for jobs that compute them side by side
    #[arg(long, value_name = "K/N", value_parser = Part::parse)]
    part: Option<Part>,
    /// Keep the end of each run as a PLY file
    #[arg(long)]
    save: bool,
    /// Runs side by side, each on one thread [default: all cores]
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..))]
    threads: Option<u16>,
}

/// Runs `nappe sweep`.
///
/// # Errors
/// When the scene cannot be read, a key, a value or a measure is not allowed, the folder holds another sweep or one is running there,
/// a file cannot be written, or the user ends it: rows that are there stay. That a run fails is a row, and no error.
pub(crate) fn run(args: &SweepArgs) -> Result<()> {
    match (&args.action, &args.runs) {
        (Some(Action::Join(args)), _) => join(args),
        (None, Some(runs)) => compute(runs, args.force.existing(), args.output.format()),
        (None, None) => Err(CliError::usage("a scene is needed, with --set and --out")),
    }
}

fn compute(args: &RunsArgs, existing: Existing, format: Format) -> Result<()> {
    let text = Source::text(&args.scene)?;
    let sweep = asked(args, &text)?;
    let description = description(args, &text, &sweep);
    files::check_folder(&args.out)?;
    let _lock = lock::take(&args.out)?;
    let all = sweep.values.len();
    let mut table = Table::open(&args.out, description, &columns(&sweep), all, sweep.part, existing)?;

    let threads = study::threads(args.threads);
    let (sweep, table) = study::compute(threads, None, move |budget, tell| {
        sweep.go(&mut table, threads, budget, tell).map(|()| (sweep, table))
    })??;
    // Of a part alone nothing is drawn.
    let drawn = args.part.is_none().then(|| columns(&sweep));
    let written = finish(&args.out, &args.scene, drawn.as_ref(), &table)?;
    say(&args.scene, args.part, format, &table, &written)?;
    if !table.is_complete() {
        let message = format!(
            "interrupted: sweep.csv has {} of {} runs; it resumes when it is started again",
            table.len(),
            table.runs()
        );
        return Err(CliError::new(Exit::Interrupted, message));
    }
    Ok(())
}

/// Puts parts together. One that lacks rows is told, once the others are there.
fn join(args: &JoinArgs) -> Result<()> {
    let parts = Parts::read(&args.parts)?;
    files::check_folder(&args.out)?;
    let _lock = lock::take(&args.out)?;
    let table = parts.put_into(&args.out, args.force.existing())?;
    let written = finish(&args.out, &parts.scene, Some(&parts.columns()), &table)?;
    say(&parts.scene, None, args.output.format(), &table, &written)?;
    let lacking = parts.lacking(&table);
    if lacking.is_empty() {
        return Ok(());
    }
    let message = format!(
        "sweep.csv has {} of {} runs; parts that lack some: {}",
        table.len(),
        table.runs(),
        lacking.join(", ")
    );
    let hint = "join again once they have all of them, or start the sweep in this folder without --part";
    Err(CliError::failure(message).hint(hint))
}

/// Draws what these columns hold, if anything is to be drawn; the paths of all files that a sweep has written.
fn finish(out: &Path, scene: &str, drawn: Option<&Columns<'_>>, table: &Table) -> Result<Vec<PathBuf>> {
    let mut written = vec![out.join("sweep.csv"), out.join("sweep.json")];
    let Some(columns) = drawn else { return Ok(written) };
    let name = Path::new(scene).file_stem().unwrap_or_default().to_string_lossy();
    for (name, bytes) in picture_files(&name, columns, table)? {
        let path = out.join(name);
        write::write_whole(&path, &bytes, Existing::Overwritten)?;
        written.push(path);
    }
    Ok(written)
}

/// What is asked for, with its meshes.
fn asked(args: &RunsArgs, text: &str) -> Result<Sweep> {
    let scene = Scene::parse(text, &args.scene)?;
    let sample = args.sample.map(|count| (count, args.seed));
    let values = combinations(&args.sets, sample)?;
    let choosing = check(&scene, &args.scene, &args.sets)?;
    check_distinct(&args.measures)?;
    let keys: Vec<String> = args.sets.iter().map(|set| set.key.clone()).collect();
    let end = End::asked(args.steps, args.until, &scene, &keys)?;
    let names = named_by_any(&scene, &keys, &values, &choosing);
    let meshes = Meshes::read(&names, &folder_of(Path::new(&args.scene)));
    let common = Common { meshes, end, measures: args.measures.clone() };
    let ends = args.save.then(|| args.out.clone());
    let part = args.part.unwrap_or(Part::WHOLE);
    let sweep = Sweep { scene, keys, values, part, common, ends };
    sweep.check_measures()?;
    Ok(sweep)
}

/// What a sweep has to have in common with one that goes on.
fn description(args: &RunsArgs, text: &str, sweep: &Sweep) -> Description {
    let Sweep { keys, values, common, .. } = sweep;
    let measures: Vec<&str> = common.measures.iter().map(|measure| measure.name.as_str()).collect();
    let file = |(file, hash): (&String, &Option<String>)| json!({ "file": file, "hash": hash });
    let files: Vec<Value> = common.meshes.hashes.iter().map(file).collect();
    let mut asked = json!({
        "scene": args.scene,
        "scene_hash": output::hash(xxh3_64(text.as_bytes())),
        "version": env!("CARGO_PKG_VERSION"),
        "keys": keys,
        "values": values,
        "steps": common.end.same_steps(),
        "until_s": common.end.time(),
        "save": args.save,
        "measures": measures,
        "files": files,
    });
    if let Some(part) = args.part {
        asked["part"] = json!(part.to_string());
    }
    Description::new(asked)
}

fn columns(sweep: &Sweep) -> Columns<'_> {
    Columns { keys: &sweep.keys, measures: &sweep.common.measures }
}

/// Refuses keys that the scene lacks and values that its schema does not allow, all of them at once; the places of keys that
/// choose meshes.
fn check(scene: &Scene, file: &str, sets: &[Set]) -> Result<Vec<usize>> {
    let (mut wrong, mut choosing) = (Vec::new(), Vec::new());
    let meshes = named(scene);
    for (place, set) in sets.iter().enumerate() {
        for value in set.examples() {
            match scene.with_values(&[(set.key.clone(), value)]) {
                Ok(other) if named(&other) != meshes => choosing.push(place),
                Ok(_) => {}
                Err(error) => wrong.push(format!("{file}: {error}")),
            }
        }
    }
    wrong.dedup();
    choosing.dedup();
    if wrong.is_empty() { Ok(choosing) } else { Err(CliError::usage(wrong.join("\n"))) }
}

fn say(scene: &str, part: Option<Part>, format: Format, table: &Table, written: &[PathBuf]) -> Result<()> {
    let (runs, rows, ok) = (table.runs(), table.len(), table.ok_count());
    let json = json!({
        "scene": scene,
        "part": part.map(|part| part.to_string()),
        "runs": runs,
        "rows": rows,
        "ok": ok,
        "complete": table.is_complete(),
        "files": written,
    });
    let finished = format!("{ok} of {} finished", output::several(runs as u64, "run"));
    let words = match rows - ok {
        0 => format!("{finished}."),
        others => format!("{finished}; {others} did not."),
    };
    files::say(format, &json, &words, written)
}

//! `nappe sweep`: one scene with other values, side by side.

use std::path::{Path, PathBuf};

use clap::Args;
use nappe_scene::Scene;
use serde_json::json;
use xxhash_rust::xxh3::xxh3_64;

use crate::{
    error::{CliError, Exit, Result},
    output::{self, Format, OutputArgs},
    paths, scene,
    study::{self, files},
    sweep::{Set, Sweep, Table, combinations, folder_of},
    write::ForceArgs,
};

/// Run a scene with other values of its keys, side by side, a row per run
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe sweep flag --set body.flag.springs.bend.stiffness=1,5,20 --set wind.0=2,4 --out study
  nappe sweep my.toml --set body.cloth.drag=0.001..0.1 --sample 50 --seed 1 --out study --save

Keys are those of the scene file with a dot between them, bodies, objects and colliders by their names, numbers of a list by
their places from 0 on. Values go through the schema before anything runs.

It writes sweep.csv, a row per run as it ends, in the order of the combinations in the end, and sweep.json, what was asked for.
Started again with the same arguments it goes on where it was, and with --force it begins anew. With --json the last line is one object with the paths.")]
pub(crate) struct SweepArgs {
    /// A shipped scene's name, or a scene file (.toml) with its meshes beside it
    scene: String,
    /// A key, and the values that it takes, or with --sample their range
    #[arg(long = "set", value_name = "KEY=V,V,...", required = true, value_parser = Set::parse)]
    sets: Vec<Set>,
    /// Folder for the files
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// So many combinations at random, in place of every one
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    sample: Option<u32>,
    /// Where samples come from
    #[arg(long, value_name = "N", default_value_t = 1, requires = "sample")]
    seed: u64,
    /// Steps of each run [default: to the end of the scene]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    steps: Option<u64>,
    /// Keep the end of each run as a PLY file
    #[arg(long)]
    save: bool,
    /// Runs side by side, each on one thread [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe sweep`.
///
/// # Errors
/// When the scene cannot be read, a key or a value is not allowed, the folder holds another sweep, a file cannot be written, or the
/// user ends it: rows that are there stay. That a run fails is a row, and no error.
pub(crate) fn run(args: &SweepArgs) -> Result<()> {
    let path = Path::new(&args.scene);
    let text = if paths::is_scene(path) {
        nappe_scene::files::read_scene(path)?
    } else {
        scene::shipped_text(&args.scene)?.to_owned()
    };
    let scene = Scene::parse(&text, &args.scene)?;
    let sample = args.sample.map(|count| (count, args.seed));
    let values = combinations(&args.sets, sample)?;
    check(&scene, &args.scene, &args.sets)?;
    let steps = args.steps.unwrap_or(scene.steps);
    if steps == 0 {
        return Err(CliError::usage("the scene has no end, steps = 0: say how many with --steps N"));
    }
    files::check_folder(&args.out)?;
    let keys: Vec<String> = args.sets.iter().map(|set| set.key.clone()).collect();
    let description = json!({
        "scene": args.scene,
        "scene_hash": output::hash(xxh3_64(text.as_bytes())),
        "version": env!("CARGO_PKG_VERSION"),
        "keys": keys,
        "values": values,
        "steps": steps,
        "save": args.save,
    });
    let names: Vec<&str> = keys.iter().map(String::as_str).collect();
    let mut table = Table::open(&args.out, &description, &names, args.force.existing())?;

    let threads = args.threads.map_or_else(rayon::current_num_threads, usize::from);
    let ends = args.save.then(|| args.out.clone());
    let sweep = Sweep { scene, meshes: folder_of(path), keys, values, steps, ends };
    let (table, is_stopped) = study::compute(threads, None, move |budget, tell| {
        sweep.go(&mut table, threads, budget, tell).map(|is_stopped| (table, is_stopped))
    })??;
    say(args, &table, description["values"].as_array().map_or(0, Vec::len))?;
    if is_stopped {
        return Err(CliError::new(Exit::Interrupted, "interrupted: started again it goes on where it was"));
    }
    Ok(())
}

/// Refuses keys that the scene lacks and values that its schema does not allow, all of them at once.
fn check(scene: &Scene, file: &str, sets: &[Set]) -> Result<()> {
    let mut wrong = Vec::new();
    for set in sets {
        for value in set.examples() {
            if let Err(error) = scene.with_values(&[(set.key.clone(), value)]) {
                wrong.push(format!("{file}: {error}"));
            }
        }
    }
    wrong.dedup();
    if wrong.is_empty() { Ok(()) } else { Err(CliError::usage(wrong.join("\n"))) }
}

fn say(args: &SweepArgs, table: &Table, runs: usize) -> Result<()> {
    let written = [args.out.join("sweep.csv"), args.out.join("sweep.json")];
    let (rows, ok) = (table.len(), table.ok_count());
    match args.output.format() {
        Format::Json => output::json(&json!({
            "scene": args.scene,
            "runs": runs,
            "rows": rows,
            "ok": ok,
            "files": written,
        })),
        Format::Text => {
            output::line(&format!("{rows} of {runs} runs: {ok} came to their end, {} did not.", rows - ok))?;
            output::line(&files::told(&written))
        }
    }
}

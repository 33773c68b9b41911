//! `nappe scenes`: the scenes that come with nappe, or with a server, and coarser copies of scenes.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use nappe_scene::{CoarserScene, NoMeshes, Scene, SceneLimits, coarser, mesh::springs_csv, printable};
use nappe_server::numbers::whole;
use nappe_sim::{cloth::Spring, mesh::MeshSpring};

use crate::{
    files::{
        paths,
        write::{self, ForceArgs},
    },
    scenes::scene,
    words::{
        error::{CliError, Result},
        output::{self, Column, Format, OutputArgs},
    },
};

/// List the scenes that come with nappe
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "\
Examples:
  nappe scenes                                              the scenes that come with nappe
  nappe scenes flag > my.toml                               the text of one, as a start for one's own
  nappe scenes drap10 --springs springs.csv                 the springs of its cloth, as a table
  nappe scenes coarser my.toml --by 2 --write coarse.toml   a copy with a quarter of the particles"
)]
pub(crate) struct ScenesArgs {
    #[command(subcommand)]
    action: Option<Action>,
    /// Print the text of this scene, as a start for one's own
    #[arg(value_name = "SCENE")]
    name: Option<String>,
    /// Write the springs of its cloth into a table, which `nappe mesh springs` reads
    #[arg(long, value_name = "FILE.csv", requires = "name", help_heading = "Output")]
    springs: Option<PathBuf>,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Subcommand, Debug)]
enum Action {
    /// Print or write a coarser copy of a scene: fewer particles for the same cloth, larger cells for the same snow
    Coarser(CoarserArgs),
}

#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe scenes coarser hanging_sheet --by 2                        a quarter of the particles, on standard output
  nappe scenes coarser my.toml --by 3 --write coarse.toml          then: nappe run coarse.toml

Grids, chains and snow have coarser copies. N divides the gaps between the particles of a grid along both sides, or the
particles themselves. A copy is another model of the same cloth: docs/scenes.md says what it keeps. --json is one object
with scene, by, changes, and text, or with --write the path, written.")]
struct CoarserArgs {
    /// A shipped scene's name, or a scene file (.toml)
    #[arg(value_name = "SCENE")]
    scene: String,
    /// How many times as far particles are apart, and how many times as large cells of snow are; 2 or more
    #[arg(long, value_name = "N", value_parser = whole::<u32>(2..=100_000))]
    by: u32,
    /// Write the copy into a file in place of standard output
    #[arg(long, value_name = "FILE.toml", help_heading = "Output")]
    write: Option<PathBuf>,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe scenes`.
///
/// # Errors
/// When there is no scene of this name, it has no coarser copy or no springs, or what is asked for cannot be written.
pub(crate) fn run(args: &ScenesArgs) -> Result<()> {
    match (&args.action, &args.name) {
        (Some(Action::Coarser(args)), _) => copy(args),
        (None, Some(name)) => match &args.springs {
            Some(path) => write_springs(name, path, args),
            None => show(name, args.output.format()),
        },
        (None, None) => list(args.output.format()),
    }
}

fn show(name: &str, format: Format) -> Result<()> {
    let text = scene::shipped_text(name)?;
    match format {
        Format::Json => output::json(&serde_json::json!({ "name": name, "text": text })),
        Format::Text => output::line(text.trim_end()),
    }
}

/// Writes the springs of the one cloth of a scene as a table.
fn write_springs(name: &str, path: &Path, args: &ScenesArgs) -> Result<()> {
    let scene = Scene::parse(scene::shipped_text(name)?, name)?;
    let built = scene.build(&NoMeshes, &SceneLimits::default())?;
    let [body] = built.setup.bodies.as_slice() else {
        let count = built.setup.bodies.len();
        let message =
            format!("--springs: {name} has {count} bodies of cloth; a table has the springs of one");
        return Err(CliError::failure(message));
    };
    let spring = |spring: &Spring| MeshSpring {
        points: spring.particles,
        kind: spring.kind,
        stiffness: spring.law.stiffness,
        damping: spring.law.damping,
        rest_length: Some(spring.rest_length),
    };
    let springs: Vec<MeshSpring> = body.network.springs.iter().map(spring).collect();
    if springs.is_empty() {
        return Err(CliError::failure(format!("--springs: the cloth of {name} has none")));
    }
    write::write_whole(path, springs_csv(&springs).as_bytes(), args.force.existing())?;
    match args.output.format() {
        Format::Json => {
            output::json(&serde_json::json!({ "scene": name, "springs": springs.len(), "written": path }))
        }
        Format::Text => {
            let count = output::several(springs.len() as u64, "spring");
            output::line(&format!("{}: {count} of {name}", path.display()))
        }
    }
}

fn list(format: Format) -> Result<()> {
    let scenes = scene::shipped()?;
    match format {
        Format::Json => output::json(&scenes),
        Format::Text => {
            let rows: Vec<Vec<String>> = scenes
                .iter()
                .map(|scene| vec![scene.name.to_owned(), scene.steps.to_string(), scene.title.clone()])
                .collect();
            let columns = [Column::Left("scene"), Column::Right("steps"), Column::Left("title")];
            output::line(&output::table(&columns, &rows))?;
            output::line("\n`nappe run NAME` computes one; `nappe scenes NAME` prints its text.")
        }
    }
}

/// Prints or writes a coarser copy.
fn copy(args: &CoarserArgs) -> Result<()> {
    let CoarserArgs { scene: name, by, .. } = args;
    let text = if paths::is_scene(Path::new(name)) {
        scene::file_text(Path::new(name))?
    } else {
        scene::shipped_text(name)?.to_owned()
    };
    let CoarserScene { text, changes } = coarser(&text, name, *by)?;
    let differs = changes.join("; ");
    let text = format!("# A copy of {}, coarser by {by}: {}.\n{text}", printable(name), printable(&differs));

    let Some(path) = &args.write else {
        return match args.output.format() {
            Format::Json => output::json(
                &serde_json::json!({ "scene": name, "by": by, "changes": changes, "text": text }),
            ),
            // A scene file as it is: TOML has no control characters but tabs and ends of lines, which have to stay.
            Format::Text => output::verbatim(text.trim_end()),
        };
    };
    check_meshes(&text, name, path)?;
    write::write_whole(path, text.as_bytes(), args.force.existing())?;
    match args.output.format() {
        Format::Json => {
            output::json(&serde_json::json!({ "scene": name, "by": by, "changes": changes, "written": path }))
        }
        Format::Text => output::line(&format!("{}: {differs}", path.display())),
    }
}

/// Refuses a place from which the meshes of the scene are not found: it names them from the folder that it is in.
fn check_meshes(text: &str, name: &str, path: &Path) -> Result<()> {
    let scene = Scene::parse(text, name)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let files = scene.mesh_files().flat_map(|(mesh, springs)| {
        let springs = springs.map(|springs| (springs, "a table of springs"));
        [Some((mesh, "a mesh")), springs].into_iter().flatten()
    });
    for (file, what) in files {
        if !folder.join(file).exists() {
            let message =
                format!("--write {}: there is no {file} beside it, {what} of the scene", path.display());
            return Err(CliError::failure(message).hint("the copy is written beside its scene"));
        }
    }
    Ok(())
}

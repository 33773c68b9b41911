//! `nappe mecasim`: the course's command line, as it is.
//!
//! Reads the course's parameter files and meshes, and computes the scene that they describe, or writes it as a scene file.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use nappe_scene::{
    Mesh, Scene,
    course::{CourseObject, MecasimOptions, Viscosity, mecasim_scene},
    files, printable,
};
use nappe_server::numbers::whole;
use nappe_sim::{cloth::Integrator, mesh::TriangleMesh};

use crate::{
    compute::{self, Server},
    files::paths,
    options::args::{ComputeArgs, JobArgs, OtherServerArgs},
    outside::remote,
    scenes::{
        meshes::{self, MissingMass},
        scene, scene_files,
    },
    words::{
        error::{CliError, Result},
        output::{self, Format, OutputArgs},
    },
};

/// Compute the objects of the MecaSim course from its own files
#[derive(Args, Debug)]
#[command(after_help = "\
Examples, from the folder that holds the course's data and exec:
  nappe mecasim 1 exec/Fichier_Param.simu exec/Fichier_Param.objet1 --steps 400
  nappe mecasim 2 exec/Fichier_Param.simu exec/Fichier_Param.objet1 exec/Fichier_Param.objet2 --save two.rrd
  nappe mecasim 1 exec/Fichier_Param.simu exec/Fichier_Param.objet1 --write drap.toml   then: nappe run drap.toml

The files of points, triangles, masses and textures are relative to the current folder, as in the
course. The steps are NbIter of the simulation file unless --steps says otherwise. --json ends with the
object of `nappe run --json`; with --write it is {\"written\"}, the paths of the scene file and its meshes.")]
pub(crate) struct MecasimArgs {
    /// Number of objects, as the course's program has it
    #[arg(value_parser = whole::<usize>(1..))]
    count: usize,
    /// Simulation file of the course
    #[arg(value_name = "SCENE.simu")]
    simu: PathBuf,
    /// Object files of the course, as many as announced
    #[arg(value_name = "OBJECT", required = true)]
    objects: Vec<PathBuf>,
    /// Use viscosite as the drag of the medium (N s/m); the course reads it and leaves it unused
    #[arg(long)]
    viscosity: bool,
    /// Integrator of every object [default: what its file says]; an implicit one solves by its tolerance, unless the file
    /// says implicite with NbIterVitImpl
    #[arg(long, value_name = "NAME", value_parser = integrator())]
    integrator: Option<Integrator>,
    /// Write the scene as a scene file of nappe, with its meshes as PLY files beside it, and compute nothing
    #[arg(long, value_name = "FILE.toml", conflicts_with_all = ["save", "start", "resume", "server"], help_heading = "Output")]
    write: Option<PathBuf>,
    #[command(flatten)]
    masses: MissingMass,
    #[command(flatten)]
    compute: ComputeArgs,
    #[command(flatten)]
    server: OtherServerArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe mecasim`.
///
/// # Errors
/// When the counts disagree, a file cannot be read, the simulation fails, or the user ends it.
pub(crate) fn run(args: &MecasimArgs) -> Result<()> {
    if args.count != args.objects.len() {
        return Err(CliError::usage(format!(
            "{} objects announced, {} object files given",
            args.count,
            args.objects.len()
        ))
        .hint("nappe mecasim COUNT SCENE.simu OBJECT1 [OBJECT2 ...]"));
    }

    let (scene, meshes) = read(args)?;
    if let Some(path) = &args.write {
        return write(args, path, scene, &meshes);
    }
    let scene = scene::Input::made(args.simu.display().to_string(), scene, meshes);
    let (server, job) = (Server::new(&args.server), JobArgs::default());
    remote::block_on(compute::compute(&scene, &args.compute, &job, server, args.output.format()))
}

/// Reads everything that the command line names: the scene, and its meshes by the paths in it.
fn read(args: &MecasimArgs) -> Result<(Scene, BTreeMap<String, TriangleMesh>)> {
    let simu = files::load_simu(&args.simu)?;

    let (mut objects, mut warnings) = (Vec::new(), Vec::new());
    let mut loaded = BTreeMap::new();
    for (number, path) in (1..).zip(&args.objects) {
        let parameters = files::load_object_parameters(path)?;
        let object = files::load_object(&parameters, Path::new(""), &args.masses.options())
            .map_err(meshes::in_words)?;
        warnings.extend(object.warnings);
        // The object's number keeps two objects with the same file apart.
        let file = format!("{}#{number}", path.display());
        objects.push((parameters, Mesh::file(file.clone())));
        loaded.insert(file, object.mesh);
    }

    let objects: Vec<_> =
        objects.iter().map(|(parameters, mesh)| CourseObject { parameters, mesh }).collect();
    let viscosity = if args.viscosity { Viscosity::Drag } else { Viscosity::Unused };
    let options = MecasimOptions { viscosity, integrator: args.integrator, ..MecasimOptions::default() };

    let (scene, odd) = mecasim_scene(&simu, &objects, &options)?;
    warnings.extend(odd);
    meshes::note(&warnings);
    Ok((scene, loaded))
}

/// Writes the scene with what the command line says of its keys, and says where.
fn write(
    args: &MecasimArgs,
    path: &Path,
    mut scene: Scene,
    meshes: &BTreeMap<String, TriangleMesh>,
) -> Result<()> {
    if !paths::is_scene(path) {
        return Err(CliError::usage(format!("--write {}: a scene file ends in .toml", path.display())));
    }
    args.compute.overrides.put_into(&mut scene);
    let objects: Vec<String> = args.objects.iter().map(|object| object.display().to_string()).collect();
    let comment = format!("Made by `nappe mecasim` of {} and {}.", args.simu.display(), objects.join(", "));
    let existing = args.compute.force.existing();
    let written = scene_files::write(path, &printable(&comment), scene, meshes, existing)?;
    match args.output.format() {
        Format::Json => output::json(&serde_json::json!({ "written": written })),
        Format::Text => {
            let files: Vec<String> = written.iter().map(|file| file.display().to_string()).collect();
            let scene = path.display();
            output::line(&format!("Written: {}; `nappe run {scene}` computes the scene", files.join(", ")))
        }
    }
}

/// An integrator by its name in scene files.
fn integrator() -> impl TypedValueParser<Value = Integrator> {
    PossibleValuesParser::new(Integrator::ALL.map(Integrator::name)).try_map(|name| {
        Integrator::ALL.into_iter().find(|known| known.name() == name).ok_or("no integrator has this name")
    })
}

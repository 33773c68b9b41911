//! `nappe mecasim`: the course's command line, as it is.
//!
//! Reads the course's parameter files and meshes, uploads the meshes, and computes the scene that
//! they describe.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use clap::Args;
use nappe_scene::{
    Mesh,
    course::{CourseObject, MecasimOptions, Viscosity, mecasim_scene},
    files,
};

use crate::{
    args::{ComputeArgs, OtherServerArgs},
    compute::{self, Server},
    error::{CliError, Result},
    meshes::{self, MissingMass},
    output::OutputArgs,
    remote, scene,
};

/// Compute the objects of the MecaSim course from its own files
#[derive(Args, Debug)]
#[command(after_help = "\
Examples, from the folder that holds the course's data and exec:
  nappe mecasim 1 exec/Fichier_Param.simu exec/Fichier_Param.objet1 --steps 400
  nappe mecasim 2 exec/Fichier_Param.simu exec/Fichier_Param.objet1 exec/Fichier_Param.objet2 --save two.rrd

The files of points, triangles, masses and textures are relative to the current folder, as in the
course. The steps are NbIter of the simulation file unless --steps says otherwise. --json ends with the
object of `nappe run --json`.")]
pub(crate) struct MecasimArgs {
    /// Number of objects, as the course's program has it
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

    let scene = input(args)?;
    let server = Server::new(&args.server);
    remote::block_on(compute::compute(&scene, &args.compute, server, args.output.format()))
}

/// Reads everything that the command line names.
fn input(args: &MecasimArgs) -> Result<scene::Input> {
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
    let options = MecasimOptions { viscosity, ..MecasimOptions::default() };

    let (scene, odd) = mecasim_scene(&simu, &objects, &options)?;
    warnings.extend(odd);
    meshes::note(&warnings);
    Ok(scene::Input::made(args.simu.display().to_string(), scene, loaded))
}

//! `nappe mesh`: makes grids, converts between formats, gives a mesh springs, takes frames of figures, describes a mesh,
//! uploads a file.

use std::{
    io::{BufWriter, Write as _},
    path::{Path, PathBuf},
};

use clap::{Args, Subcommand};
use nappe_client::MeshFile;
use nappe_scene::{
    files,
    mesh::{course_grid, write_pc2},
};
use nappe_server::numbers::{Least, METRES, PLAIN, real};
use nappe_sim::mesh::TriangleMesh;

use crate::{
    files::write::{self, ForceArgs},
    options::args::ServerArgs,
    outside::remote,
    scenes::{
        mesh_info,
        meshes::{self, MissingMass},
        moving::{self, Ending, Wanted},
    },
    words::{
        error::{CliError, Result},
        output::{self, Format, OutputArgs},
    },
};

/// Make, convert, describe and upload meshes
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe mesh grid 70x70 --spacing 0.1 --course --out drap70   the course's drap70, digit for digit
  nappe mesh grid 40x60 --spacing 0.02 --out sheet.obj        a flat sheet
  nappe mesh convert cow.off cow.ply                          by extension
  nappe mesh convert data/vache vache.obj                     a folder of .eti files
  nappe mesh springs cow.obj springs.csv --out cow.ply        the mesh with springs of its own
  nappe mesh frames man.glb --rate 30 --out man               man.ply and man.pc2, for a figure of a scene
  nappe mesh info data/pull                                   counts, size, parts, borders, volume, what is odd
  nappe mesh info *.obj --json                                one JSON object per line
  nappe mesh info ear.stl cow.ply.gz                          STL joins corners; gzip is unpacked
  nappe mesh upload cow.obj                                   prints the id that a scene names

Formats, by extension: .obj, .off, .ply; .stl is read only. What gzip has packed is read too, as .obj.gz and so on,
but not uploaded. A folder, or a name without an extension, holds .eti files.")]
pub(crate) struct MeshArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand, Debug)]
enum Action {
    /// Make a grid of particles, with two triangles per cell
    Grid(GridArgs),
    /// Convert a mesh from one format to another
    Convert(ConvertArgs),
    /// Give a mesh springs of its own, from a table with the columns particle_a, particle_b and stiffness, and perhaps damping,
    /// rest_length and kind; a scene takes them by springs = { pattern = "file" }
    Springs(SpringsArgs),
    /// Write what a figure of a scene needs, FILE.ply and FILE.pc2: of the skin and the animation of a glTF 2 file, or of a
    /// folder with an .obj or .ply for each frame, in the order of their names
    Frames(FramesArgs),
    /// Describe meshes: counts, size, parts, open edges, volume, what is odd or missing; one that cannot be read does
    /// not keep the others from it
    Info(InfoArgs),
    /// Upload a mesh file, which the server reads; print its id
    Upload(UploadArgs),
}

#[derive(Args, Debug)]
struct GridArgs {
    /// Particles across and down, 2x2 to 4000x4000
    #[arg(value_name = "COLUMNSxROWS", value_parser = size)]
    size: [usize; 2],
    /// Distance between neighbours (m)
    #[arg(long, value_name = "METRES", default_value_t = 0.1, value_parser = real(METRES, Least::Above0))]
    spacing: f64,
    /// The course's grid: upright, with its ripple, and mass 0 at the two upper corners
    #[arg(long)]
    course: bool,
    /// Mesh file, or folder for .eti files, to write
    #[arg(long, value_name = "FILE|FOLDER")]
    out: PathBuf,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Args, Debug)]
struct ConvertArgs {
    /// Mesh to read
    input: PathBuf,
    /// Mesh to write
    out: PathBuf,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    masses: MissingMass,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Args, Debug)]
struct SpringsArgs {
    /// Mesh to read; springs that it has are replaced
    #[arg(value_name = "MESH")]
    input: PathBuf,
    /// Table of springs to read
    #[arg(value_name = "SPRINGS.csv")]
    springs: PathBuf,
    /// Mesh file to write, a .ply
    #[arg(long, value_name = "FILE.ply")]
    out: PathBuf,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    masses: MissingMass,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Args, Debug)]
struct FramesArgs {
    /// File to read, .glb or .gltf, or folder
    #[arg(value_name = "FILE|FOLDER")]
    input: PathBuf,
    /// Frames in a second (1/s); a folder has its frames already
    #[arg(long, value_name = "RATE", default_value_t = 30.0, value_parser = real(PLAIN, Least::Above0))]
    rate: f64,
    /// Number of the animation of a glTF file, from 0, where it has several
    #[arg(long, value_name = "NUMBER")]
    animation: Option<usize>,
    /// Leave out a frame at the end, which shows what the first one does: for frames with repeat = "loop"
    #[arg(long = "loop")]
    is_looped: bool,
    /// Files to write, without their ending
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Args, Debug)]
struct InfoArgs {
    /// Meshes to read
    #[arg(value_name = "MESH", required = true)]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Args, Debug)]
struct UploadArgs {
    /// Mesh file, or folder of .eti files
    #[arg(value_name = "MESH")]
    input: PathBuf,
    #[command(flatten)]
    masses: MissingMass,
    #[command(flatten)]
    server: ServerArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe mesh`.
///
/// # Errors
/// When a mesh cannot be read, written or uploaded.
pub(crate) fn run(args: &MeshArgs) -> Result<()> {
    match &args.action {
        Action::Grid(args) => grid(args),
        Action::Convert(args) => {
            let loaded = meshes::load(&args.input, args.masses)?;
            write(&loaded.mesh, &args.out, args.force, args.output.format())
        }
        Action::Springs(args) => springs(args),
        Action::Frames(args) => frames(args),
        Action::Info(args) => info(args),
        Action::Upload(args) => upload(args),
    }
}

fn springs(args: &SpringsArgs) -> Result<()> {
    if !args.out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ply")) {
        let out = args.out.display();
        return Err(CliError::usage(format!("--out is {out}: only a .ply holds springs")));
    }
    let mut mesh = meshes::load(&args.input, args.masses)?.mesh;
    mesh.springs = files::load_springs(&args.springs, mesh.points.len(), &args.masses.options())?;
    write(&mesh, &args.out, args.force, args.output.format())
}

fn frames(args: &FramesArgs) -> Result<()> {
    let out = args.out.display();
    let is_ending =
        |ending: &std::ffi::OsStr| ["ply", "pc2"].iter().any(|known| ending.eq_ignore_ascii_case(known));
    if args.out.extension().is_some_and(is_ending) {
        let message =
            format!("--out is {out}: allowed is a name without .ply or .pc2, which are added to it");
        return Err(CliError::usage(message));
    }
    let [ply, pc2] = [".ply", ".pc2"].map(|ending| {
        let mut name = args.out.as_os_str().to_owned();
        name.push(ending);
        PathBuf::from(name)
    });
    for path in [&ply, &pc2] {
        write::check(path, args.force.existing())?;
    }

    let ending = if args.is_looped { Ending::Looped } else { Ending::Held };
    let wanted = Wanted { rate: args.rate, animation: args.animation, ending };
    let moving = moving::load(&args.input, wanted)?;
    meshes::note(&moving.warnings);
    files::save_mesh(&ply, &moving.mesh, args.force.existing())?;
    write::write_by(&pc2, args.force.existing(), |file| {
        let mut buffered = BufWriter::new(file);
        write_pc2(&moving.frames, &mut buffered)?;
        buffered.flush()
    })?;

    let (points, triangles) = (moving.mesh.points.len(), moving.mesh.triangles.len());
    let (count, joined, bytes) = (moving.frames.count(), moving.joined, moving.frames.bytes());
    let steps = if args.is_looped { count } else { count - 1 };
    let seconds = steps as f64 / args.rate;
    match args.output.format() {
        Format::Json => output::json(&serde_json::json!({
            "out": args.out, "files": [ply, pc2], "points": points, "joined": joined, "triangles": triangles,
            "frames": count, "seconds": seconds, "bytes": bytes,
        })),
        Format::Text => output::line(&format!(
            "{} and {}: {}, {}, {}; rate = {} makes {seconds:.3} s of them",
            ply.display(),
            pc2.display(),
            output::several(points as u64, "point"),
            output::several(triangles as u64, "triangle"),
            output::several(count as u64, "frame"),
            args.rate
        )),
    }
}

fn upload(args: &UploadArgs) -> Result<()> {
    let path = args.input.display();
    let mut file =
        MeshFile::read(&args.input).map_err(|error| CliError::failure(format!("{path}: {error}")))?;
    file.missing_mass = args.masses.options().eti.missing_mass;
    let uploaded =
        remote::block_on(async { Ok(remote::connect(&args.server).await?.upload_file(&file).await?) })?;
    meshes::note(&uploaded.warnings);
    match args.output.format() {
        Format::Json => {
            output::json(&serde_json::json!({ "mesh_id": uploaded.mesh_id, "warnings": uploaded.warnings }))
        }
        Format::Text => output::line(&uploaded.mesh_id),
    }
}

fn grid(args: &GridArgs) -> Result<()> {
    let [columns, rows] = args.size;
    let mesh = if args.course {
        course_grid(columns, rows, args.spacing)
    } else {
        TriangleMesh::grid(columns, rows, args.spacing)
    };
    write(&mesh, &args.out, args.force, args.output.format())
}

fn write(mesh: &TriangleMesh, path: &Path, force: ForceArgs, format: Format) -> Result<()> {
    let files = files::save_mesh(path, mesh, force.existing())?;
    if let Some(lost) = lost(mesh, path) {
        meshes::note(&[format!("{}: {lost}", path.display())]);
    }
    let (points, triangles) = (mesh.points.len(), mesh.triangles.len());
    match format {
        Format::Json => output::json(
            &serde_json::json!({ "out": path, "files": files, "points": points, "triangles": triangles }),
        ),
        Format::Text => output::line(&format!(
            "{}: {}, {}",
            path.display(),
            output::several(points as u64, "point"),
            output::several(triangles as u64, "triangle")
        )),
    }
}

/// What the format cannot hold. A folder of .eti files, whatever its name, holds everything but springs.
fn lost(mesh: &TriangleMesh, path: &Path) -> Option<String> {
    let extension = path.extension().and_then(|extension| extension.to_str()).map(str::to_lowercase);
    let extension = extension.filter(|_| !path.is_dir());
    let format = extension.as_deref().unwrap_or("eti");
    let parts = [
        ("masses", !mesh.masses.is_empty() && matches!(format, "obj" | "off")),
        ("texture coordinates", !mesh.uv.is_empty() && format == "off"),
        ("springs", !mesh.springs.is_empty() && format != "ply"),
    ];
    let lost: Vec<&str> = parts.into_iter().filter(|(_, is_lost)| *is_lost).map(|(what, _)| what).collect();
    let what = match lost[..] {
        [] => return None,
        [only] => only.to_owned(),
        [ref first @ .., last] => format!("{} and {last}", first.join(", ")),
    };
    Some(format!("the format .{format} holds no {what}: they are left out"))
}

/// Describes meshes, also those after one that cannot be described.
fn info(args: &InfoArgs) -> Result<()> {
    let (mut described, mut failures) = (0, Vec::new());
    for path in &args.inputs {
        let info = match mesh_info::describe(path) {
            Ok(info) => info,
            Err(error) => {
                failures.push(error.to_string());
                continue;
            }
        };
        match args.output.format() {
            Format::Json => output::json(&info)?,
            Format::Text if described == 0 => output::line(&mesh_info::table(&info))?,
            Format::Text => output::line(&format!("\n{}", mesh_info::table(&info)))?,
        }
        described += 1;
    }
    if failures.is_empty() { Ok(()) } else { Err(CliError::failure(failures.join("\n"))) }
}

fn size(text: &str) -> std::result::Result<[usize; 2], String> {
    let wrong =
        || format!("'{text}' is not the size of a grid: COLUMNSxROWS, 2x2 to 4000x4000, such as 70x70");
    let (columns, rows) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let count = |text: &str| text.parse::<usize>().ok().filter(|n| (2..=4000).contains(n)).ok_or_else(wrong);
    Ok([count(columns)?, count(rows)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_of_grids_have_two_counts() {
        assert_eq!(size("70x50"), Ok([70, 50]));
        for wrong in ["70", "1x70", "70x", "x", "-2x2", "5000x2"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}

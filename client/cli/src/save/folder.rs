//! A folder with PLY files: per frame one of the particles, and one of the snow's grid if it is kept.
//!
//! Particles: x, y, z (m) and, where they are kept, vx, vy, vz (m/s), plastic_ratio (1) and stress_norm (Pa), in the
//! precision of the session: binary64 holds its exact state. Nodes of the grid, in binary32: x, y, z (m), mass (kg),
//! vx, vy, vz (m/s).

use std::{
    fs,
    io::{self, BufWriter, Write as _},
    path::{Path, PathBuf},
};

use nappe_client::{Encoding, Frame, GridFrame, Scalars, Topology, Vectors, WatchOptions, v1};
use nappe_scene::mesh::{PlyFrame, PlyNumbers, PlyProperty, write_ply_frame};

use crate::{
    error::{CliError, Result},
    fields::FieldsArgs,
    write::{self, Existing},
};

/// Properties of a PLY file that hold a velocity (m/s).
const VELOCITY: [&str; 3] = ["vx", "vy", "vz"];

/// PLY files: frame-000000.ply, frame-000001.ply ... and grid-000000.ply ...
pub(crate) struct Folder {
    path: PathBuf,
    fields: FieldsArgs,
    triangles: Vec<[u32; 3]>,
    /// Files of another run, which go when the first frame comes.
    old: Vec<PathBuf>,
}

impl Folder {
    /// Makes the folder, or takes one that holds no frames that stay.
    pub(super) fn create(path: &Path, existing: Existing, fields: &FieldsArgs) -> Result<Self> {
        fs::create_dir_all(path).map_err(|error| CliError::file("make the folder", path, &error))?;
        let old = frames(path).map_err(|error| CliError::file("read the folder", path, &error))?;
        if let Some(name) = old.first().and_then(|file| file.file_name())
            && existing == Existing::Kept
        {
            return Err(CliError::failure(format!(
                "the folder {} holds frames already ({}): two runs would be mixed up",
                path.display(),
                name.display(),
            ))
            .hint("--force removes them; or give another folder"));
        }
        Ok(Self { path: path.to_owned(), fields: fields.clone(), triangles: Vec::new(), old })
    }

    /// These watch options with what is kept, in the precision of a session.
    pub(super) fn watch(&self, options: WatchOptions, session: &v1::Session) -> WatchOptions {
        let encoding = match session.precision() {
            v1::Precision::F64 => Encoding::F64,
            v1::Precision::F32 | v1::Precision::Unspecified => Encoding::F32,
        };
        WatchOptions { encoding, ..self.fields.watch(options) }
    }

    /// Keeps the triangles, which every file repeats.
    pub(super) fn topology(&mut self, topology: Topology) {
        self.triangles = topology.bodies.into_iter().flat_map(|body| body.triangles).collect();
    }

    /// Writes the files of a frame.
    ///
    /// # Errors
    /// When one cannot be written.
    pub(super) fn write(&mut self, frame: &Frame) -> Result<()> {
        for file in self.old.drain(..) {
            fs::remove_file(&file).map_err(|error| CliError::file("remove", &file, &error))?;
        }
        let properties: Vec<PlyProperty<'_>> = [
            property(&VELOCITY, frame.velocities.as_ref().map(vectors)),
            property(&["plastic_ratio"], frame.plastic_ratios.as_ref().map(scalars)),
            property(&["stress_norm"], frame.stress_norms.as_ref().map(scalars)),
        ]
        .into_iter()
        .flatten()
        .collect();

        let particles = PlyFrame {
            positions: vectors(&frame.positions),
            properties: &properties,
            triangles: &self.triangles,
            step: frame.step,
            time: frame.time,
        };
        write(&self.path.join(format!("frame-{:06}.ply", frame.frame)), &particles)?;

        match &frame.grid {
            Some(grid) => self.write_grid(frame, grid),
            None => Ok(()),
        }
    }

    fn write_grid(&self, frame: &Frame, grid: &GridFrame) -> Result<()> {
        let positions: Vec<f32> = grid.positions().flatten().collect();
        let nodes = PlyFrame {
            positions: PlyNumbers::F32(&positions),
            properties: &[
                PlyProperty { names: &["mass"], values: PlyNumbers::F32(&grid.masses) },
                PlyProperty { names: &VELOCITY, values: PlyNumbers::F32(grid.velocities.as_flattened()) },
            ],
            triangles: &[],
            step: frame.step,
            time: frame.time,
        };
        write(&self.path.join(format!("grid-{:06}.ply", frame.frame)), &nodes)
    }
}

/// The properties of an array, if it is kept.
fn property<'a>(names: &'a [&'a str], values: Option<PlyNumbers<'a>>) -> Option<PlyProperty<'a>> {
    values.map(|values| PlyProperty { names, values })
}

fn vectors(vectors: &Vectors) -> PlyNumbers<'_> {
    match vectors {
        Vectors::F32(numbers) => PlyNumbers::F32(numbers),
        Vectors::F64(numbers) => PlyNumbers::F64(numbers),
    }
}

fn scalars(scalars: &Scalars) -> PlyNumbers<'_> {
    match scalars {
        Scalars::F32(numbers) => PlyNumbers::F32(numbers),
        Scalars::F64(numbers) => PlyNumbers::F64(numbers),
    }
}

/// The files of frames and grids in a folder.
fn frames(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if (name.starts_with("frame-") || name.starts_with("grid-"))
            && entry.path().extension().is_some_and(|ending| ending == "ply")
        {
            found.push(entry.path());
        }
    }
    found.sort();
    Ok(found)
}

fn write(path: &Path, points: &PlyFrame<'_>) -> Result<()> {
    let mut out = BufWriter::new(write::create(path, Existing::Kept)?);
    write_ply_frame(points, &mut out)
        .and_then(|()| out.flush())
        .map_err(|error| CliError::file("write", path, &error))
}

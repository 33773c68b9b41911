//! A folder with PLY files: per frame one of the particles, and one of the snow's grid if it is kept.
//!
//! Particles: x, y, z (m) and, where they are kept, vx, vy, vz (m/s), plastic_ratio (1) and stress_norm (Pa).
//! Nodes of the grid: x, y, z (m), mass (kg), vx, vy, vz (m/s).

use std::{
    fs::{self, File},
    io::{BufWriter, Write as _},
    path::{Path, PathBuf},
};

use nappe_client::{Frame, GridFrame, Scalars, Topology, Vectors, WatchOptions};
use nappe_scene::mesh::{PlyFrame, PlyProperty, write_ply_frame};

use crate::{
    error::{CliError, Result},
    fields::FieldsArgs,
};

/// Properties of a PLY file that hold a velocity (m/s).
const VELOCITY: [&str; 3] = ["vx", "vy", "vz"];

/// PLY files: frame-000000.ply, frame-000001.ply ... and grid-000000.ply ...
pub(crate) struct Folder {
    path: PathBuf,
    fields: FieldsArgs,
    triangles: Vec<[u32; 3]>,
}

impl Folder {
    /// Makes the folder, or takes one that holds no frames.
    pub(super) fn create(path: &Path, fields: &FieldsArgs) -> Result<Self> {
        fs::create_dir_all(path).map_err(|error| CliError::file("make the folder", path, &error))?;
        let entries = fs::read_dir(path).map_err(|error| CliError::file("read the folder", path, &error))?;
        for entry in entries {
            let entry = entry.map_err(|error| CliError::file("read the folder", path, &error))?;
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.starts_with("frame-") || name.starts_with("grid-") {
                return Err(CliError::failure(format!(
                    "the folder {} holds frames already ({name}): two runs would be mixed up",
                    path.display(),
                ))
                .hint("remove them, or give another folder"));
            }
        }
        Ok(Self { path: path.to_owned(), fields: fields.clone(), triangles: Vec::new() })
    }

    /// These watch options with what is kept.
    pub(super) fn watch(&self, options: WatchOptions) -> WatchOptions {
        self.fields.watch(options)
    }

    /// Keeps the triangles, which every file repeats.
    pub(super) fn topology(&mut self, topology: Topology) {
        self.triangles = topology.bodies.into_iter().flat_map(|body| body.triangles).collect();
    }

    /// Writes the files of a frame.
    ///
    /// # Errors
    /// When one cannot be written.
    pub(super) fn write(&self, frame: &Frame) -> Result<()> {
        let velocities = frame.velocities.as_ref().map(Vectors::to_f32);
        let ratios = frame.plastic_ratios.as_ref().map(Scalars::to_f32);
        let stresses = frame.stress_norms.as_ref().map(Scalars::to_f32);

        let properties: Vec<PlyProperty<'_>> = [
            property(&VELOCITY, velocities.as_deref()),
            property(&["plastic_ratio"], ratios.as_deref()),
            property(&["stress_norm"], stresses.as_deref()),
        ]
        .into_iter()
        .flatten()
        .collect();

        let particles = PlyFrame {
            positions: &frame.positions.to_f32(),
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
            positions: &positions,
            properties: &[
                PlyProperty { names: &["mass"], values: &grid.masses },
                PlyProperty { names: &VELOCITY, values: grid.velocities.as_flattened() },
            ],
            triangles: &[],
            step: frame.step,
            time: frame.time,
        };
        write(&self.path.join(format!("grid-{:06}.ply", frame.frame)), &nodes)
    }
}

/// The properties of an array, if it is kept.
fn property<'a>(names: &'a [&'a str], values: Option<&'a [f32]>) -> Option<PlyProperty<'a>> {
    values.map(|values| PlyProperty { names, values })
}

fn write(path: &Path, points: &PlyFrame<'_>) -> Result<()> {
    File::create(path)
        .and_then(|file| {
            let mut out = BufWriter::new(file);
            write_ply_frame(points, &mut out)?;
            out.flush()
        })
        .map_err(|error| CliError::file("write", path, &error))
}

//! A folder with one PLY mesh a frame.

use std::{
    fs::{self, File},
    io::{BufWriter, Write as _},
    path::{Path, PathBuf},
};

use nappe_client::{Frame, Topology};
use nappe_scene::mesh::{PlyFrame, write_ply_frame};

use crate::error::{CliError, Result};

/// One PLY mesh a frame: frame-000000.ply, frame-000001.ply ...
pub(super) struct Folder {
    path: PathBuf,
    triangles: Vec<[u32; 3]>,
}

impl Folder {
    /// Makes the folder, or takes one that holds no frames.
    pub(super) fn create(path: &Path) -> Result<Self> {
        fs::create_dir_all(path).map_err(|error| CliError::file("make the folder", path, &error))?;
        let entries = fs::read_dir(path).map_err(|error| CliError::file("read the folder", path, &error))?;
        for entry in entries {
            let entry = entry.map_err(|error| CliError::file("read the folder", path, &error))?;
            if entry.file_name().to_string_lossy().starts_with("frame-") {
                return Err(CliError::failure(format!(
                    "the folder {} holds frames already ({}): two runs would be mixed up",
                    path.display(),
                    entry.file_name().to_string_lossy()
                ))
                .hint("remove them, or give another folder"));
            }
        }
        Ok(Self { path: path.to_owned(), triangles: Vec::new() })
    }

    /// Keeps the triangles, which every file repeats.
    pub(super) fn topology(&mut self, topology: Topology) {
        self.triangles = topology.bodies.into_iter().flat_map(|body| body.triangles).collect();
    }

    /// Writes the file of a frame.
    pub(super) fn write(&self, frame: &Frame) -> Result<()> {
        let path = self.path.join(format!("frame-{:06}.ply", frame.frame));
        let mesh = PlyFrame {
            positions: &frame.positions.to_f32(),
            triangles: &self.triangles,
            step: frame.step,
            time: frame.time,
        };
        File::create(&path)
            .and_then(|file| {
                let mut out = BufWriter::new(file);
                write_ply_frame(&mesh, &mut out)?;
                out.flush()
            })
            .map_err(|error| CliError::file("write", &path, &error))
    }
}

//! Where the bodies of a session begin: positions and velocities of a saved frame in place of those of the scene.
//!
//! Enters: a PLY file, or a folder of them, of which the last frame counts. Leaves: a change before the first step.

use std::path::{Path, PathBuf};

use nappe_client::{Client, Event, MeshUpload, Topology, WatchOptions, v1};
use nappe_scene::{
    files::{self, ReadOptions},
    mesh::Loaded,
};

use crate::error::{CliError, Result};

/// A saved frame: places and velocities of all particles.
#[derive(Debug)]
pub(crate) struct SavedFrame {
    file: PathBuf,
    positions: Vec<[f64; 3]>,
    velocities: Vec<[f64; 3]>,
}

impl SavedFrame {
    /// Reads a file, or the last frame of a folder.
    ///
    /// # Errors
    /// When there is none, or it cannot be read.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let file = if path.is_dir() { last_frame(path)? } else { path.to_owned() };
        let name = file.display().to_string();
        let loaded = files::load_mesh(&file, &ReadOptions::default());
        let Loaded { mesh, .. } = loaded.map_err(|error| CliError::failure(error.to_string()))?;
        if mesh.velocities.is_empty() {
            return Err(CliError::failure(format!("{name} has no velocities (vx, vy, vz)"))
                .hint("frames saved with --fields velocity have them"));
        }
        Ok(Self { file, positions: mesh.points, velocities: mesh.velocities })
    }

    /// Puts the bodies of a session where those of the frame are.
    ///
    /// # Errors
    /// When the frame has other particles than the session, or a call fails.
    pub(crate) async fn put(&self, client: &Client, session_id: &str) -> Result<()> {
        let topology = topology(client, session_id).await?;
        let counts: Vec<usize> = topology.bodies.iter().map(|body| body.particle_count).collect();
        let (found, needed) = (self.positions.len(), counts.iter().sum::<usize>());
        if found != needed {
            let bodies = topology.bodies.iter().map(|body| format!("{} {}", body.name, body.particle_count));
            let bodies = bodies.collect::<Vec<_>>().join(", ");
            let file = self.file.display();
            return Err(CliError::failure(format!(
                "{file} has {found} particles, and the scene has {needed} ({bodies}): a frame of the same scene is needed"
            )));
        }

        let (mut states, mut first) = (Vec::new(), 0);
        for (body, count) in topology.bodies.iter().zip(counts) {
            let own = first..first + count;
            first += count;
            let upload = MeshUpload {
                name: body.name.clone(),
                points: self.positions[own.clone()].to_vec(),
                velocities: self.velocities[own].to_vec(),
                ..MeshUpload::default()
            };
            let upload_id = client.upload_mesh(&upload).await?.mesh_id;
            states.push(v1::StateUpdate { body: body.name.clone(), upload_id, ..v1::StateUpdate::default() });
        }
        let update = v1::UpdateParametersRequest { states, ..v1::UpdateParametersRequest::of(session_id) };
        client.update(update).await?;
        Ok(())
    }
}

/// What frames of a session refer to.
async fn topology(client: &Client, session_id: &str) -> Result<Topology> {
    let mut watch = client.watch(session_id, WatchOptions::default()).await?;
    while let Some(event) = watch.next().await {
        if let Event::Topology(topology) = event? {
            return Ok(topology);
        }
    }
    Err(CliError::failure(format!("the stream of session {session_id} ended before its topology")))
}

/// The file of the last frame in a folder.
fn last_frame(folder: &Path) -> Result<PathBuf> {
    let entries =
        std::fs::read_dir(folder).map_err(|error| CliError::file("read the folder", folder, &error))?;
    let name =
        |path: &PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let frames = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| {
        name(path).starts_with("frame-") && path.extension().is_some_and(|ending| ending == "ply")
    });
    frames.max_by_key(|path| name(path)).ok_or_else(|| {
        CliError::failure(format!("the folder {} holds no frame (frame-000000.ply)", folder.display()))
    })
}

//! The mesh files that a scene names, with the springs of the tables that go with them.
//!
//! Enters: a scene, and the folder that it is in. Leaves: meshes, what they are known by, and the ids that a server gives to them.

use std::{collections::BTreeMap, path::Path};

use nappe_client::Client;
use nappe_scene::{
    Scene,
    files::{self, ReadOptions},
};
use nappe_sim::mesh::{MeshSpring, TriangleMesh};
use xxhash_rust::xxh3::Xxh3;

use crate::{scenes::meshes, words::error::Result};

/// A mesh file and the table of springs that goes with it, if there is one, by the paths in the scene.
type Named = (String, Option<String>);

/// Meshes by the files that they come from.
#[derive(Debug, Default)]
pub(crate) struct MeshFiles(BTreeMap<Named, TriangleMesh>);

/// The ids of meshes on a server.
#[derive(Debug)]
pub(crate) struct MeshIds(BTreeMap<Named, String>);

impl MeshFiles {
    /// Meshes by the paths that a scene has for them; none of their bodies has a table of springs.
    pub(crate) fn without_tables(meshes: BTreeMap<String, TriangleMesh>) -> Self {
        Self(meshes.into_iter().map(|(file, mesh)| ((file, None), mesh)).collect())
    }

    /// Reads what a scene names, relative to a folder; tells what is odd about it.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub(crate) fn read(scene: &Scene, folder: &Path) -> Result<Self> {
        let (mut meshes, options) = (BTreeMap::new(), ReadOptions::default());
        for (file, table) in scene.mesh_files() {
            let named = (file.to_owned(), table.map(str::to_owned));
            if meshes.contains_key(&named) {
                continue;
            }
            let loaded = files::load_mesh(&folder.join(file), &options)
                .map_err(|error| meshes::in_words(scene.error_of_mesh_file(file, error)))?;
            meshes::note(&loaded.warnings);
            let mut mesh = loaded.mesh;
            if let Some(table) = table {
                mesh.springs = files::load_springs(&folder.join(table), mesh.points.len(), &options)
                    .map_err(|error| scene.error_of_springs_file(table, error))?;
            }
            meshes.insert(named, mesh);
        }
        Ok(Self(meshes))
    }

    /// Adds them to a hash.
    pub(crate) fn add_to(&self, hasher: &mut Xxh3) {
        for ((file, table), mesh) in &self.0 {
            hasher.update(file.as_bytes());
            hasher.update(table.as_deref().unwrap_or_default().as_bytes());
            hash_mesh(mesh, hasher);
        }
    }

    /// Sends them to a server.
    ///
    /// # Errors
    /// When the server refuses one.
    pub(crate) async fn send(&self, client: &Client) -> Result<MeshIds> {
        let mut ids = BTreeMap::new();
        for (named, mesh) in &self.0 {
            // What is odd about it is told of the body that is made of it, once it is in order.
            ids.insert(named.clone(), meshes::send(client, &named.0, mesh).await?);
        }
        Ok(MeshIds(ids))
    }
}

impl MeshIds {
    /// The id of the mesh from a file, with the springs of a table.
    pub(crate) fn get(&self, file: &str, table: Option<&str>) -> Option<String> {
        self.0.get(&(file.to_owned(), table.map(str::to_owned))).cloned()
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Adds a mesh to a hash.
fn hash_mesh(mesh: &TriangleMesh, hasher: &mut Xxh3) {
    let TriangleMesh { points, triangles, masses, uv, velocities, springs } = mesh;
    let lists = [points.as_flattened(), masses.as_slice(), uv.as_flattened(), velocities.as_flattened()];
    for list in lists {
        hasher.update(&(list.len() as u64).to_le_bytes());
        for number in list {
            hasher.update(&number.to_le_bytes());
        }
    }
    for corner in triangles.as_flattened() {
        hasher.update(&corner.to_le_bytes());
    }
    for MeshSpring { points: [a, b], kind, stiffness, damping, rest_length } in springs {
        hasher.update(&[a.to_le_bytes(), b.to_le_bytes()].concat());
        hasher.update(kind.name().as_bytes());
        for number in [*stiffness, *damping, rest_length.unwrap_or(f64::NAN)] {
            hasher.update(&number.to_le_bytes());
        }
    }
}

//! The files of meshes and of their springs that runs of a sweep name: read once, shared by all runs, and known by the hashes of their bytes.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
    sync::Arc,
};

use nappe_scene::{
    ErrorKind, MeshSource, Scene, SceneError,
    files::{self, ReadOptions},
    mesh::read_springs_csv,
};
use nappe_sim::mesh::{MeshSpring, TriangleMesh};
use xxhash_rust::xxh3::xxh3_64;

use crate::{scenes::meshes, words::output};

/// A mesh file, and the table of springs that a body takes it with, if it names one.
type Named = (String, Option<String>);

/// The text of a table of springs, and where it is.
struct Table {
    file: String,
    text: String,
}

/// Meshes by the names that scenes have for their files; of those that cannot be read, why.
pub(crate) struct Meshes {
    read: BTreeMap<String, Result<TriangleMesh, SceneError>>,
    tables: BTreeMap<String, Result<Table, SceneError>>,
    /// Hashes of the files that they were read from, of an `.eti` set of each; none of what cannot be read.
    pub(crate) hashes: BTreeMap<String, Option<String>>,
}

impl Meshes {
    /// Reads meshes whose names are relative to a folder; tells what is odd about them.
    pub(crate) fn read(names: &BTreeSet<Named>, folder: &Path) -> Self {
        let (mut read, mut hashes, mut tables) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        for name in names.iter().filter_map(|(_, table)| table.as_ref()) {
            let path = folder.join(name);
            let text = files::load_text(&path, &ReadOptions::default());
            let hash = text.as_ref().ok().map(|text| output::hash(xxh3_64(text.as_bytes())));
            hashes.insert(name.clone(), hash);
            let table = text.map(|text| Table { file: path.display().to_string(), text });
            tables.insert(name.clone(), table);
        }
        let names: BTreeSet<&String> = names.iter().map(|(mesh, _)| mesh).collect();
        for name in names {
            let path = folder.join(name);
            let mut keep = |file: &Path, bytes: &[u8]| {
                // A file of a set is called by its place beside the scene.
                let inner = file.strip_prefix(folder).unwrap_or(file).display().to_string();
                let file = if file == path { name.clone() } else { inner };
                hashes.insert(file, Some(output::hash(xxh3_64(bytes))));
            };
            let loaded = files::load_mesh_and_tell(&path, &ReadOptions::default(), &mut keep);
            match &loaded {
                Ok(loaded) => meshes::note(&loaded.warnings),
                Err(_) => {
                    hashes.entry(name.clone()).or_insert(None);
                }
            }
            read.insert(name.clone(), loaded.map(|loaded| loaded.mesh));
        }
        Self { read, tables, hashes }
    }
}

impl MeshSource for Meshes {
    fn upload(&self, _: &str) -> Option<Arc<TriangleMesh>> {
        None
    }

    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        self.read.get(path).cloned().unwrap_or_else(|| {
            let message = "is not among the meshes that were read when the sweep began";
            Err(SceneError::new(ErrorKind::MeshNotFound, path, message))
        })
    }

    fn springs_file(&self, path: &str, points: usize) -> Result<Vec<MeshSpring>, SceneError> {
        match self.tables.get(path) {
            Some(Ok(table)) => read_springs_csv(&table.text, &table.file, points),
            Some(Err(error)) => Err(error.clone()),
            None => {
                let message = "is not among the tables of springs that were read when the sweep began";
                Err(SceneError::new(ErrorKind::MeshNotFound, path, message))
            }
        }
    }
}

/// The mesh files that a scene names, in its order, with their tables of springs.
pub(crate) fn named(scene: &Scene) -> Vec<Named> {
    scene.mesh_files().map(|(mesh, table)| (mesh.to_owned(), table.map(str::to_owned))).collect()
}

/// The mesh files that any run names, where only the keys at some places choose meshes.
pub(crate) fn named_by_any(
    scene: &Scene,
    keys: &[String],
    values: &[Vec<String>],
    choosing: &[usize],
) -> BTreeSet<Named> {
    let chosen: BTreeSet<Vec<(String, String)>> = values
        .iter()
        .map(|values| choosing.iter().map(|place| (keys[*place].clone(), values[*place].clone())).collect())
        .collect();
    // A run whose scene is refused names none.
    let scenes = chosen.iter().filter_map(|values| scene.with_values(values).ok());
    scenes.flat_map(|scene| named(&scene)).collect()
}

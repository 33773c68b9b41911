//! A scene with the meshes beside it.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
    sync::Arc,
};

use nappe_scene::{
    ErrorKind, Mesh, MeshSource, Scene, SceneError, SceneLimits,
    files::{Existing, ReadOptions, load_mesh, save_mesh},
};
use nappe_sim::mesh::TriangleMesh;

use super::World;

/// A scene, and the meshes that it names as files.
#[derive(Clone, Debug)]
pub struct Case {
    /// The scene as it is written.
    pub scene: Scene,
    /// The files beside it, by name.
    pub meshes: BTreeMap<String, TriangleMesh>,
}

impl MeshSource for Case {
    fn upload(&self, _: &str) -> Option<Arc<TriangleMesh>> {
        None
    }

    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        let none = || SceneError::new(ErrorKind::Unsupported, path, "is not there");
        self.meshes.get(path).cloned().ok_or_else(none)
    }
}

impl Case {
    /// The scene of a file, with the meshes that it names.
    ///
    /// # Errors
    /// What cannot be read, in words.
    pub fn of_file(path: &Path) -> Result<Self, String> {
        let text = fs::read_to_string(path).map_err(|error| error.to_string())?;
        let scene = Scene::parse(&text, "scene.toml").map_err(|errors| errors.to_string())?;
        let mut meshes = BTreeMap::new();
        for mesh in scene.meshes() {
            if let Mesh::File { file, .. } = mesh {
                let path = path.with_file_name(file);
                let loaded = load_mesh(&path, &ReadOptions::default()).map_err(|error| error.to_string())?;
                meshes.insert(file.clone(), loaded.mesh);
            }
        }
        Ok(Self { scene, meshes })
    }

    /// Its world, of the scene as a file holds it.
    ///
    /// # Errors
    /// What the reader or the builder refuses, in words.
    pub fn world(&self) -> Result<World, String> {
        let scene = Scene::parse(&self.scene.to_toml(), "scene.toml").map_err(|errors| errors.to_string())?;
        let built = scene.build(self, &SceneLimits::default()).map_err(|errors| errors.to_string())?;
        let Scene { precision, steps, .. } = scene;
        Ok(World { setup: built.setup, changes: built.initial_changes, precision, steps })
    }

    /// Writes the scene and its meshes into a folder that is made; returns the path of the scene.
    ///
    /// # Errors
    /// Those of the system.
    pub fn write(&self, folder: &Path) -> io::Result<PathBuf> {
        fs::create_dir_all(folder)?;
        for (file, mesh) in &self.meshes {
            let saved = save_mesh(&folder.join(file), mesh, Existing::Overwritten);
            saved.map_err(|error| io::Error::other(error.to_string()))?;
        }
        let path = folder.join("scene.toml");
        fs::write(&path, self.scene.to_toml())?;
        Ok(path)
    }
}

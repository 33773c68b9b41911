//! Scenes as the command line names them: a shipped name or a file.
//!
//! Reads scene files and the meshes beside them; sends the meshes to the server and writes their
//! ids into the scene, so that a server never opens a client's files.

use std::{collections::BTreeMap, fs, path::Path};

use nappe_client::{Client, MeshUpload, Scene as Sent};
use nappe_scene::{Mesh, Scene};
use nappe_sim::mesh::TriangleMesh;
use serde::Serialize;

use crate::{
    error::{CliError, Result},
    meshes::{self, MissingMass},
    paths,
};

/// A scene that comes with nappe.
#[derive(Debug, Serialize)]
pub(crate) struct Shipped {
    /// Name for the command line.
    pub(crate) name: &'static str,
    /// Title, as the scene has it.
    pub(crate) title: String,
    /// Steps to its end; 0: it has none.
    pub(crate) steps: u64,
}

/// The scenes that come with nappe.
///
/// # Errors
/// When one does not read, which would be an error in this program.
pub(crate) fn shipped() -> Result<Vec<Shipped>> {
    nappe_scene::shipped_scenes()
        .iter()
        .map(|(name, text)| {
            let scene = Scene::parse(text, name)?;
            Ok(Shipped { name, title: scene.title, steps: scene.steps })
        })
        .collect()
}

/// The text of a shipped scene.
///
/// # Errors
/// When there is none of this name.
pub(crate) fn shipped_text(name: &str) -> Result<&'static str> {
    let scenes = nappe_scene::shipped_scenes();
    scenes.iter().find(|(known, _)| *known == name).map(|(_, text)| *text).ok_or_else(|| {
        let names: Vec<&str> = scenes.iter().map(|(name, _)| *name).collect();
        CliError::failure(format!("no scene '{name}' comes with nappe: there are {}", names.join(", ")))
            .hint("a scene of your own is a file: its path ends in .toml")
    })
}

/// Who must know the name of a shipped scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Names {
    /// This command, so that a name is checked before anything starts.
    Ours,
    /// The server that it talks to, which may ship other scenes.
    Servers,
}

/// A scene to be computed.
#[derive(Debug)]
pub(crate) enum Input {
    /// A shipped scene.
    Named(String),
    /// A scene with its meshes.
    Written(Box<Written>),
}

/// A scene read and checked, with its meshes.
#[derive(Debug)]
pub(crate) struct Written {
    /// As the command line names it.
    name: String,
    scene: Scene,
    /// The text as it was written; a server's messages then have the lines of the file.
    text: String,
    /// Meshes to send, by the path in the scene.
    meshes: BTreeMap<String, TriangleMesh>,
}

impl Input {
    /// A shipped scene by its name, or a file by a path that ends in `.toml`.
    ///
    /// # Errors
    /// When there is no such scene, or it or a mesh of it cannot be read.
    pub(crate) fn read(name: &str, names: Names) -> Result<Self> {
        let path = Path::new(name);
        if paths::is_scene(path) {
            let text = fs::read_to_string(path).map_err(|error| CliError::file("read", path, &error))?;
            return Written::parse(name, text, path.parent().unwrap_or(Path::new("")));
        }
        if names == Names::Ours {
            shipped_text(name)?;
        }
        Ok(Self::Named(name.to_owned()))
    }

    /// A scene made by the program, with its meshes by the path that it names.
    pub(crate) fn made(name: String, scene: Scene, meshes: BTreeMap<String, TriangleMesh>) -> Self {
        let text = scene.to_toml();
        Self::Written(Box::new(Written { name, scene, text, meshes }))
    }

    /// The scene as the command line names it.
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Named(name) => name,
            Self::Written(written) => &written.name,
        }
    }

    /// The scene's text, where this command has it.
    pub(crate) fn text(&self) -> Option<&str> {
        match self {
            Self::Named(name) => shipped_text(name).ok(),
            Self::Written(written) => Some(&written.text),
        }
    }

    /// Sends the meshes; the scene that then names them by their ids.
    ///
    /// # Errors
    /// When the server refuses a mesh.
    pub(crate) async fn send(&self, client: &Client) -> Result<Sent> {
        match self {
            Self::Named(name) => Ok(Sent::Named(name.clone())),
            Self::Written(written) => written.send(client).await,
        }
    }
}

impl Written {
    fn parse(name: &str, text: String, folder: &Path) -> Result<Input> {
        let scene = Scene::parse(&text, name)?;
        let mut meshes = BTreeMap::new();
        for mesh in scene.meshes() {
            if let Mesh::File { file, .. } = mesh
                && !meshes.contains_key(file)
            {
                let loaded = meshes::load(&folder.join(file), MissingMass::default())?;
                meshes.insert(file.clone(), loaded.mesh);
            }
        }
        Ok(Input::Written(Box::new(Self { name: name.to_owned(), scene, text, meshes })))
    }

    async fn send(&self, client: &Client) -> Result<Sent> {
        if self.meshes.is_empty() {
            return Ok(Sent::Text(self.text.clone()));
        }
        // The server reads the scene as it is written anew below, and sees no old names.
        meshes::note(&self.scene.warnings());
        let mut ids = BTreeMap::new();
        for (file, mesh) in &self.meshes {
            let uploaded = client.upload_mesh(&upload(file, mesh)).await?;
            let warnings: Vec<_> =
                uploaded.warnings.iter().map(|warning| format!("{file}: {warning}")).collect();
            meshes::note(&warnings);
            ids.insert(file.as_str(), uploaded.mesh_id);
        }

        let mut scene = self.scene.clone();
        for mesh in scene.meshes_mut() {
            if let Mesh::File { file, repair } = mesh {
                *mesh = Mesh::Upload { upload: ids[file.as_str()].clone(), repair: *repair };
            }
        }
        Ok(Sent::Text(scene.to_toml()))
    }
}

fn upload(name: &str, mesh: &TriangleMesh) -> MeshUpload {
    MeshUpload {
        name: name.to_owned(),
        points: mesh.points.clone(),
        triangles: mesh.triangles.clone(),
        masses: mesh.masses.clone(),
        uv: mesh.uv.iter().map(|&[u, v]| [u as f32, v as f32]).collect(),
    }
}

//! Scenes and meshes that sessions are made from: the shipped scenes, and what clients uploaded.
//!
//! Enters: names, texts, meshes. Leaves: scenes ready to be simulated. Opens no file: a client's
//! scene can name uploads and formulas only.

use std::sync::{Arc, Mutex, PoisonError};

use nappe_scene::{Built, Fault, MeshSource, Scene, SceneError, SceneLimits, shipped_scenes};
use nappe_sim::mesh::TriangleMesh;
use uuid::Uuid;

use crate::{
    config::Limits,
    error::{Reason, ServiceError},
};

/// Meshes that clients uploaded: a bounded number and a bounded size; the one longest unused goes
/// first. Sessions copy what they need, so that none depends on it.
#[derive(Debug)]
pub(crate) struct MeshStore {
    /// Meshes, at least one.
    capacity: usize,
    /// Bytes of all meshes but the newest.
    budget: u64,
    /// Least recently used first.
    meshes: Mutex<Vec<(String, Arc<TriangleMesh>)>>,
}

impl MeshStore {
    /// A store within these limits; it always keeps the newest mesh.
    pub(crate) fn new(limits: &Limits) -> Self {
        let capacity = limits.max_meshes.max(1) as usize;
        Self { capacity, budget: limits.max_mesh_store_bytes, meshes: Mutex::new(Vec::new()) }
    }

    /// Keeps a mesh and returns its id.
    pub(crate) fn insert(&self, mesh: TriangleMesh) -> String {
        let id = format!("mesh-{}", Uuid::new_v4().simple());
        let mut meshes = self.meshes.lock().unwrap_or_else(PoisonError::into_inner);
        meshes.push((id.clone(), Arc::new(mesh)));
        while meshes.len() > self.capacity || (meshes.len() > 1 && self.exceeds_budget(&meshes)) {
            let (oldest, _) = meshes.remove(0);
            tracing::info!(mesh = oldest, "forgotten to make room for a newer one");
        }
        id
    }

    fn exceeds_budget(&self, meshes: &[(String, Arc<TriangleMesh>)]) -> bool {
        meshes.iter().map(|(_, mesh)| size(mesh)).sum::<u64>() > self.budget
    }

    /// The mesh of an id; it is now the most recently used.
    pub(crate) fn get(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        let mut meshes = self.meshes.lock().unwrap_or_else(PoisonError::into_inner);
        let index = meshes.iter().position(|(known, _)| known == id)?;
        let entry = meshes.remove(index);
        let mesh = Arc::clone(&entry.1);
        meshes.push(entry);
        Some(mesh)
    }
}

/// Memory of a mesh's arrays (bytes).
fn size(mesh: &TriangleMesh) -> u64 {
    let arrays = [
        size_of_val(mesh.points.as_slice()),
        size_of_val(mesh.triangles.as_slice()),
        size_of_val(mesh.masses.as_slice()),
        size_of_val(mesh.uv.as_slice()),
    ];
    arrays.iter().sum::<usize>() as u64
}

impl MeshSource for MeshStore {
    fn upload(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        self.get(id)
    }

    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        let message =
            format!("the server opens no files: upload '{path}' and name it as {{ upload = \"ID\" }}");
        Err(SceneError::new(Fault::MeshNotFound, "", message))
    }
}

/// Names of the shipped scenes.
pub(crate) fn scene_names() -> Vec<String> {
    shipped_scenes().iter().map(|(name, _)| (*name).to_owned()).collect()
}

/// The text of a shipped scene.
///
/// # Errors
/// If there is none of this name.
pub(crate) fn shipped_scene(name: &str) -> Result<&'static str, ServiceError> {
    shipped_scenes().iter().find(|(known, _)| *known == name).map(|(_, text)| *text).ok_or_else(|| {
        let known = scene_names().join(", ");
        ServiceError::new(Reason::SceneNotFound, format!("no scene is named '{name}'; there are: {known}"))
            .with("scene", name)
            .with("known", known)
    })
}

/// Reads and builds a scene's text; `file` names it in messages.
///
/// # Errors
/// The place and kind of the first fault.
pub(crate) fn build_scene(
    text: &str,
    file: &str,
    meshes: &MeshStore,
    limits: &Limits,
) -> Result<(Scene, Built), ServiceError> {
    let scene = Scene::parse(text, file).map_err(|error| scene_error(&error))?;
    let bounds = SceneLimits { max_particles: limits.max_particles, max_springs: limits.max_springs };
    let built = scene.build(meshes, &bounds).map_err(|error| scene_error(&error))?;
    Ok((scene, built))
}

fn scene_error(error: &SceneError) -> ServiceError {
    let reason = match error.fault {
        Fault::TooLarge => Reason::SceneTooLarge,
        Fault::MeshNotFound => Reason::MeshNotFound,
        _ => Reason::InvalidScene,
    };
    let refused = ServiceError::new(reason, error.to_string()).with("fault", error.fault.reason());
    let refused = if error.line > 0 { refused.with("line", error.line) } else { refused };
    let refused = if error.column > 0 { refused.with("column", error.column) } else { refused };
    if error.field.is_empty() {
        refused
    } else {
        refused.with("field", &error.field).at_field(format!("scene_text: {}", error.field), &error.message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_store_keeps_within_its_bytes_and_always_the_newest() {
        // A grid of 3 x 3: 9 points, 8 triangles, 9 texture coordinates.
        let bytes = 9 * 24 + 8 * 12 + 9 * 16;
        let store = MeshStore::new(&Limits { max_mesh_store_bytes: 2 * bytes, ..Limits::default() });
        let ids = [(); 3].map(|()| store.insert(TriangleMesh::grid(3, 3, 1.0)));
        assert_eq!(ids.each_ref().map(|id| store.get(id).is_some()), [false, true, true]);
        let large = store.insert(TriangleMesh::grid(30, 30, 1.0));
        assert_eq!(ids.each_ref().map(|id| store.get(id).is_some()), [false; 3]);
        assert!(store.get(&large).is_some());
    }

    #[test]
    fn the_mesh_longest_unused_goes_first() {
        let store = MeshStore::new(&Limits { max_meshes: 2, ..Limits::default() });
        let first = store.insert(TriangleMesh::grid(2, 2, 1.0));
        let second = store.insert(TriangleMesh::grid(3, 3, 1.0));
        assert!(store.get(&first).is_some());
        let third = store.insert(TriangleMesh::grid(4, 4, 1.0));
        assert!(store.get(&second).is_none());
        assert_eq!(store.get(&first).expect("kept").points.len(), 4);
        assert_eq!(store.get(&third).expect("kept").points.len(), 16);
    }
}

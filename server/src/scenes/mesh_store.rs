//! Meshes that clients uploaded, kept for scenes that name them.
//!
//! Enters: checked meshes. Leaves: meshes by their id, as long as there is room. Opens no file: a
//! client's scene can name uploads and formulas only.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nappe_scene::{ErrorKind, MeshSource, SceneError};
use nappe_sim::mesh::TriangleMesh;
use uuid::Uuid;

use crate::config::Limits;

/// Uploaded meshes, bounded in number and in size: the one longest unused goes first. Sessions copy
/// what they need, so no session depends on the store.
#[derive(Debug)]
pub(crate) struct MeshStore {
    /// Meshes at most, 1 or more.
    capacity: usize,
    /// Bytes of all meshes at most; the newest is kept even if it is larger.
    budget: u64,
    /// Ids and meshes, least recently used first.
    meshes: Mutex<Vec<(String, Arc<TriangleMesh>)>>,
}

impl MeshStore {
    pub(crate) fn new(limits: &Limits) -> Self {
        let capacity = limits.max_meshes.max(1) as usize;
        Self { capacity, budget: limits.max_mesh_store_bytes, meshes: Mutex::new(Vec::new()) }
    }

    /// Keeps a mesh and returns its id.
    pub(crate) fn insert(&self, mesh: TriangleMesh) -> String {
        let id = format!("mesh-{}", Uuid::new_v4().simple());
        let mut meshes = self.lock();
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

    /// The mesh of an id, which becomes the most recently used.
    pub(crate) fn get(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        let mut meshes = self.lock();
        let index = meshes.iter().position(|(known, _)| known == id)?;
        let entry = meshes.remove(index);
        let mesh = Arc::clone(&entry.1);
        meshes.push(entry);
        Some(mesh)
    }

    fn lock(&self) -> MutexGuard<'_, Vec<(String, Arc<TriangleMesh>)>> {
        // No code that holds the lock can leave the list half changed.
        self.meshes.lock().unwrap_or_else(PoisonError::into_inner)
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
        Err(SceneError::new(ErrorKind::MeshNotFound, "", message))
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

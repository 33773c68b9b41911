//! Meshes that clients uploaded, kept for scenes that name them.
//!
//! Enters: checked meshes. Leaves: meshes by their id, as long as there is room. Opens no file: a
//! client's scene can name uploads and formulas only.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nappe_scene::{ErrorKind, MeshSource, SceneError};
use nappe_sim::{mesh::TriangleMesh, world::Vectors};
use uuid::Uuid;

use crate::{
    config::Limits,
    error::ServiceError,
    memory::{Claim, MemoryAccount},
};

/// Uploaded meshes, bounded in number and in size: the one longest unused goes first. Sessions copy what they are made
/// from, and states that wait for their step share it: no session depends on the store.
#[derive(Debug)]
pub(crate) struct MeshStore {
    /// Meshes at most, 1 or more.
    capacity: usize,
    /// Bytes of all meshes at most; the newest is kept even if it is larger.
    budget: u64,
    /// Where the memory of meshes is counted.
    account: Arc<MemoryAccount>,
    /// Least recently used first.
    meshes: Mutex<Vec<Kept>>,
}

/// A mesh that is kept.
#[derive(Debug)]
struct Kept {
    id: String,
    mesh: Arc<TriangleMesh>,
    memory: Arc<Claim>,
}

impl Kept {
    /// Vectors of the mesh, without a copy.
    fn share(&self, of: fn(&TriangleMesh) -> &[[f64; 3]]) -> Vectors {
        let shared = Shared { mesh: Arc::clone(&self.mesh), of, _memory: Arc::clone(&self.memory) };
        Vectors::counted_elsewhere(shared)
    }
}

/// Vectors of a mesh, whose memory counts for as long as somebody has them: the store may have forgotten it.
struct Shared {
    mesh: Arc<TriangleMesh>,
    of: fn(&TriangleMesh) -> &[[f64; 3]],
    _memory: Arc<Claim>,
}

impl AsRef<[[f64; 3]]> for Shared {
    fn as_ref(&self) -> &[[f64; 3]] {
        (self.of)(&self.mesh)
    }
}

impl MeshStore {
    pub(crate) fn new(limits: &Limits, account: Arc<MemoryAccount>) -> Self {
        let capacity = limits.max_meshes.max(1) as usize;
        Self { capacity, budget: limits.max_mesh_store_bytes, account, meshes: Mutex::new(Vec::new()) }
    }

    /// Keeps a mesh and returns its id.
    ///
    /// # Errors
    /// If the server has no memory for it, even without the others.
    pub(crate) fn insert(&self, mesh: TriangleMesh) -> Result<String, ServiceError> {
        let id = format!("mesh-{}", Uuid::new_v4().simple());
        let (memory, bytes) = (self.account.claim(), size(&mesh));
        let mut meshes = self.lock();
        while let Err(full) = memory.grow(bytes) {
            if meshes.is_empty() {
                return Err(full);
            }
            forget_oldest(&mut meshes);
        }

        meshes.push(Kept { id: id.clone(), mesh: Arc::new(mesh), memory: Arc::new(memory) });
        while meshes.len() > self.capacity || (meshes.len() > 1 && self.exceeds_budget(&meshes)) {
            forget_oldest(&mut meshes);
        }
        Ok(id)
    }

    fn exceeds_budget(&self, meshes: &[Kept]) -> bool {
        meshes.iter().map(|kept| size(&kept.mesh)).sum::<u64>() > self.budget
    }

    /// The mesh of an id, which becomes the most recently used.
    pub(crate) fn get(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        self.used(id, |kept| Arc::clone(&kept.mesh))
    }

    /// Points (m) and velocities (m/s) of the mesh of an id, which becomes the most recently used.
    pub(crate) fn vectors(&self, id: &str) -> Option<[Vectors; 2]> {
        self.used(id, |kept| {
            [kept.share(|mesh| mesh.points.as_slice()), kept.share(|mesh| mesh.velocities.as_slice())]
        })
    }

    fn used<T>(&self, id: &str, look: impl FnOnce(&Kept) -> T) -> Option<T> {
        let mut meshes = self.lock();
        let index = meshes.iter().position(|kept| kept.id == id)?;
        let kept = meshes.remove(index);
        let found = look(&kept);
        meshes.push(kept);
        Some(found)
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Kept>> {
        // No code that holds the lock can leave the list half changed.
        self.meshes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn forget_oldest(meshes: &mut Vec<Kept>) {
    let oldest = meshes.remove(0);
    tracing::info!(mesh = oldest.id, "forgotten to make room for a newer one");
}

/// Memory of a mesh's arrays (bytes).
fn size(mesh: &TriangleMesh) -> u64 {
    let arrays = [
        size_of_val(mesh.points.as_slice()),
        size_of_val(mesh.triangles.as_slice()),
        size_of_val(mesh.masses.as_slice()),
        size_of_val(mesh.uv.as_slice()),
        size_of_val(mesh.velocities.as_slice()),
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
    use crate::error::Reason;

    fn store(limits: &Limits) -> MeshStore {
        MeshStore::new(limits, MemoryAccount::of_server(1 << 30))
    }

    fn grid(side: usize) -> TriangleMesh {
        TriangleMesh::grid(side, side, 1.0)
    }

    #[test]
    fn a_full_server_forgets_the_oldest_mesh_and_refuses_one_that_never_fits() {
        let bytes = size(&grid(3));
        let account = MemoryAccount::of_server(3 * bytes);
        let store = MeshStore::new(&Limits::default(), Arc::clone(&account));
        let session = account.claim();
        session.grow(bytes).expect("room");
        let ids = [(); 3].map(|()| store.insert(grid(3)).expect("without the oldest, there is room"));
        assert_eq!(ids.each_ref().map(|id| store.get(id).is_some()), [false, true, true]);
        assert_eq!(account.used(), 3 * bytes);

        let refused = store.insert(grid(30)).expect_err("it never fits");
        assert_eq!(refused.reason, Reason::ServerMemoryFull);
        drop((store, session));
        assert_eq!(account.used(), 0);
    }

    #[test]
    fn a_store_keeps_within_its_bytes_and_always_the_newest() {
        // A grid of 3 x 3: 9 points, 8 triangles, 9 texture coordinates.
        let bytes = 9 * 24 + 8 * 12 + 9 * 16;
        let store = store(&Limits { max_mesh_store_bytes: 2 * bytes, ..Limits::default() });
        let ids = [(); 3].map(|()| store.insert(grid(3)).expect("room"));
        assert_eq!(ids.each_ref().map(|id| store.get(id).is_some()), [false, true, true]);
        let large = store.insert(grid(30)).expect("room");
        assert_eq!(ids.each_ref().map(|id| store.get(id).is_some()), [false; 3]);
        assert!(store.get(&large).is_some());
    }

    #[test]
    fn a_mesh_counts_for_as_long_as_somebody_has_its_points_or_its_velocities() {
        let account = MemoryAccount::of_server(1 << 30);
        let limits = Limits { max_meshes: 1, ..Limits::default() };
        let store = MeshStore::new(&limits, Arc::clone(&account));
        let moving = TriangleMesh { velocities: vec![[1.0; 3]; 9], ..grid(3) };
        let (bytes, next) = (size(&moving), size(&grid(2)));
        assert_eq!(bytes, size(&grid(3)) + 9 * 24);

        let id = store.insert(moving).expect("room");
        let [points, velocities] = store.vectors(&id).expect("it is kept");
        let again = store.vectors(&id).expect("it is kept");
        assert_eq!((points.len(), velocities.len()), (9, 9));
        assert_eq!(points.as_ptr(), again[0].as_ptr(), "nothing is copied");
        assert_eq!(account.used(), bytes);

        store.insert(grid(2)).expect("room");
        assert!(store.vectors(&id).is_none(), "it is forgotten");
        drop((points, again));
        assert_eq!(account.used(), bytes + next);
        drop(velocities);
        assert_eq!(account.used(), next);
    }

    #[test]
    fn the_mesh_longest_unused_goes_first() {
        let store = store(&Limits { max_meshes: 2, ..Limits::default() });
        let first = store.insert(grid(2)).expect("room");
        let second = store.insert(grid(3)).expect("room");
        assert!(store.get(&first).is_some());
        let third = store.insert(grid(4)).expect("room");
        assert!(store.get(&second).is_none());
        assert_eq!(store.get(&first).expect("kept").points.len(), 4);
        assert_eq!(store.get(&third).expect("kept").points.len(), 16);
    }
}

//! Meshes and frames that clients uploaded, kept for scenes that name them; and files of sessions, for sessions that go on from them.
//!
//! Enters: checked uploads. Leaves: uploads by their id, as long as there is room. Opens no file: a
//! client's scene can name uploads and formulas only.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nappe_scene::mesh::PointFrames;
use nappe_sim::{mesh::TriangleMesh, world::Vectors};
use uuid::Uuid;

use crate::{
    config::Limits,
    error::ServiceError,
    memory::{Claim, MemoryAccount},
};

/// Uploads, bounded in number and in size: the one longest unused goes first. Sessions hold the meshes that they are made
/// from, and states that wait for their step share them: no session depends on the store.
#[derive(Debug)]
pub(crate) struct MeshStore {
    /// Uploads at most, 1 or more.
    capacity: usize,
    /// Bytes of all of them at most; the newest is kept even if it is larger.
    budget: u64,
    /// Where their memory is counted.
    account: Arc<MemoryAccount>,
    /// Least recently used first.
    uploads: Mutex<Vec<Kept>>,
}

/// An upload that is kept.
#[derive(Debug)]
struct Kept {
    id: String,
    content: Content,
}

/// What was uploaded.
#[derive(Debug)]
enum Content {
    Mesh(HeldMesh),
    Frames(HeldFrames),
    Checkpoint(Checkpoint),
}

impl Content {
    /// Memory that it takes (bytes).
    fn size(&self) -> u64 {
        match self {
            Self::Mesh(held) => size(&held.mesh),
            Self::Frames(held) => held.frames.bytes(),
            Self::Checkpoint(file) => file.bytes.len() as u64,
        }
    }
}

/// A mesh, whose memory counts for as long as somebody has it: the store may have forgotten it.
#[derive(Clone, Debug)]
pub(super) struct HeldMesh {
    pub(super) mesh: Arc<TriangleMesh>,
    memory: Arc<Claim>,
}

impl HeldMesh {
    /// Vectors of the mesh, without a copy.
    fn share(&self, of: fn(&TriangleMesh) -> &[[f64; 3]]) -> Vectors {
        let shared = Shared { mesh: Arc::clone(&self.mesh), of, _memory: Arc::clone(&self.memory) };
        Vectors::counted_elsewhere(shared)
    }
}

/// Frames of points, whose memory counts for as long as somebody has them.
#[derive(Clone, Debug)]
pub(super) struct HeldFrames {
    pub(super) frames: PointFrames,
    _memory: Arc<Claim>,
}

/// The file of a session, of which the hashes were checked; its memory counts for as long as somebody has it.
#[derive(Clone, Debug)]
pub(crate) struct Checkpoint {
    bytes: Arc<Vec<u8>>,
    _memory: Arc<Claim>,
}

impl Checkpoint {
    /// A file whose memory is claimed; its hashes were checked.
    pub(crate) fn new(bytes: Vec<u8>, memory: Claim) -> Self {
        Self { bytes: Arc::new(bytes), _memory: Arc::new(memory) }
    }

    /// The bytes that `SaveSession` gave.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes
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
        Self { capacity, budget: limits.max_mesh_store_bytes, account, uploads: Mutex::new(Vec::new()) }
    }

    /// Keeps a mesh and returns its id.
    ///
    /// # Errors
    /// If the server has no memory for it, even without the others.
    pub(crate) fn insert(&self, mesh: TriangleMesh) -> Result<String, ServiceError> {
        let bytes = size(&mesh);
        self.keep("mesh", bytes, |memory| Content::Mesh(HeldMesh { mesh: Arc::new(mesh), memory }))
    }

    /// Keeps the file of a session, of which the hashes were checked, and returns its id.
    ///
    /// # Errors
    /// If the server has no memory for it, even without the others.
    pub(crate) fn insert_checkpoint(&self, file: Vec<u8>) -> Result<String, ServiceError> {
        let bytes = file.len() as u64;
        self.keep("checkpoint", bytes, |memory| {
            Content::Checkpoint(Checkpoint { bytes: Arc::new(file), _memory: memory })
        })
    }

    /// Keeps frames of points and returns their id.
    ///
    /// # Errors
    /// If the server has no memory for them, even without the others.
    pub(crate) fn insert_frames(&self, frames: PointFrames) -> Result<String, ServiceError> {
        let bytes = frames.bytes();
        self.keep("frames", bytes, |memory| Content::Frames(HeldFrames { frames, _memory: memory }))
    }

    /// Keeps an upload of so many bytes, and returns its id.
    fn keep(
        &self,
        kind: &str,
        bytes: u64,
        content: impl FnOnce(Arc<Claim>) -> Content,
    ) -> Result<String, ServiceError> {
        let id = format!("{kind}-{}", Uuid::new_v4().simple());
        let memory = self.account.claim();
        let mut uploads = self.lock();
        while let Err(full) = memory.grow(bytes) {
            if uploads.is_empty() {
                return Err(full);
            }
            forget_oldest(&mut uploads);
        }

        uploads.push(Kept { id: id.clone(), content: content(Arc::new(memory)) });
        while uploads.len() > self.capacity || (uploads.len() > 1 && self.exceeds_budget(&uploads)) {
            forget_oldest(&mut uploads);
        }
        Ok(id)
    }

    fn exceeds_budget(&self, uploads: &[Kept]) -> bool {
        uploads.iter().map(|kept| kept.content.size()).sum::<u64>() > self.budget
    }

    /// The mesh of an id, which becomes the most recently used.
    #[cfg(test)]
    pub(super) fn get(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        Some(self.hold(id)?.mesh)
    }

    /// The mesh of an id, which becomes the most recently used, and what its memory is claimed by.
    pub(super) fn hold(&self, id: &str) -> Option<HeldMesh> {
        self.used(id, |content| match content {
            Content::Mesh(held) => Some(held.clone()),
            Content::Frames(_) | Content::Checkpoint(_) => None,
        })
    }

    /// The frames of an id, which become the most recently used, and what their memory is claimed by.
    pub(super) fn hold_frames(&self, id: &str) -> Option<HeldFrames> {
        self.used(id, |content| match content {
            Content::Frames(held) => Some(held.clone()),
            Content::Mesh(_) | Content::Checkpoint(_) => None,
        })
    }

    /// The file of a session of an id, which becomes the most recently used.
    pub(crate) fn checkpoint(&self, id: &str) -> Option<Checkpoint> {
        self.used(id, |content| match content {
            Content::Checkpoint(file) => Some(file.clone()),
            Content::Mesh(_) | Content::Frames(_) => None,
        })
    }

    /// Points (m) and velocities (m/s) of the mesh of an id, which becomes the most recently used.
    pub(crate) fn vectors(&self, id: &str) -> Option<[Vectors; 2]> {
        let held = self.hold(id)?;
        Some([held.share(|mesh| mesh.points.as_slice()), held.share(|mesh| mesh.velocities.as_slice())])
    }

    fn used<T>(&self, id: &str, look: impl FnOnce(&Content) -> Option<T>) -> Option<T> {
        let mut uploads = self.lock();
        let index = uploads.iter().position(|kept| kept.id == id)?;
        let kept = uploads.remove(index);
        let found = look(&kept.content);
        uploads.push(kept);
        found
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Kept>> {
        // No code that holds the lock can leave the list half changed.
        self.uploads.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn forget_oldest(uploads: &mut Vec<Kept>) {
    let oldest = uploads.remove(0);
    tracing::info!(upload = oldest.id, "forgotten to make room for a newer one");
}

/// Memory of a mesh's arrays (bytes).
pub(super) fn size(mesh: &TriangleMesh) -> u64 {
    let arrays = [
        size_of_val(mesh.points.as_slice()),
        size_of_val(mesh.triangles.as_slice()),
        size_of_val(mesh.masses.as_slice()),
        size_of_val(mesh.uv.as_slice()),
        size_of_val(mesh.velocities.as_slice()),
        size_of_val(mesh.springs.as_slice()),
    ];
    arrays.iter().sum::<usize>() as u64
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

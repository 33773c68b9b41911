//! The meshes and frames that scenes are built from: those that they name are noted, and held for as long as they may be built again.
//!
//! Enters: a store of uploads. Leaves: what scenes ask for by id. Opens no file.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use nappe_scene::{ErrorKind, MeshSource, SceneError, mesh::PointFrames};
use nappe_sim::mesh::TriangleMesh;

use super::mesh_store::{HeldFrames, HeldMesh, MeshStore};

fn no_file(path: &str) -> Result<TriangleMesh, SceneError> {
    let message = format!("the server opens no files: upload '{path}' and name it as {{ upload = \"ID\" }}");
    Err(SceneError::new(ErrorKind::MeshNotFound, "", message))
}

/// The meshes of a store as a scene is built from them: those that it names are noted.
#[derive(Debug)]
pub(super) struct Noted<'a> {
    store: &'a MeshStore,
    held: Mutex<HeldMeshes>,
}

impl<'a> Noted<'a> {
    pub(super) fn new(store: &'a MeshStore) -> Self {
        Self { store, held: Mutex::default() }
    }

    /// Those that were named.
    pub(super) fn into_held(self) -> HeldMeshes {
        self.held.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl MeshSource for Noted<'_> {
    fn upload(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        // No code that holds the lock can leave the list half changed.
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(mesh) = held.upload(id) {
            return Some(mesh);
        }
        let found = self.store.hold(id)?;
        let mesh = Arc::clone(&found.mesh);
        held.meshes.insert(id.to_owned(), found);
        Some(mesh)
    }

    fn uploaded_frames(&self, id: &str) -> Option<PointFrames> {
        // No code that holds the lock can leave the list half changed.
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(frames) = held.uploaded_frames(id) {
            return Some(frames);
        }
        let found = self.store.hold_frames(id)?;
        let frames = found.frames.clone();
        held.frames.insert(id.to_owned(), found);
        Some(frames)
    }

    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        no_file(path)
    }
}

/// The meshes and frames that a scene was built from, by their ids: it can be built again of them, also once the store has forgotten them.
#[derive(Debug, Default)]
pub(crate) struct HeldMeshes {
    meshes: BTreeMap<String, HeldMesh>,
    frames: BTreeMap<String, HeldFrames>,
}

impl MeshSource for HeldMeshes {
    fn upload(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        self.meshes.get(id).map(|held| Arc::clone(&held.mesh))
    }

    fn uploaded_frames(&self, id: &str) -> Option<PointFrames> {
        self.frames.get(id).map(|held| held.frames.clone())
    }

    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        no_file(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{config::Limits, memory::MemoryAccount, scenes::mesh_store::size};

    fn grid(side: usize) -> TriangleMesh {
        TriangleMesh::grid(side, side, 1.0)
    }

    #[test]
    fn a_scene_finds_its_meshes_again_once_they_are_forgotten_and_they_count_until_then() {
        let account = MemoryAccount::of_server(1 << 30);
        let limits = Limits { max_meshes: 1, ..Limits::default() };
        let store = MeshStore::new(&limits, Arc::clone(&account));
        let bytes = size(&grid(3));
        let id = store.insert(grid(3)).expect("room");
        let noted = Noted::new(&store);
        assert!(noted.upload("mesh-of-nobody").is_none());
        let [first, again] = [(); 2].map(|()| noted.upload(&id).expect("it is kept"));
        assert!(Arc::ptr_eq(&first, &again));
        let held = noted.into_held();
        let checkpoint = store.insert_checkpoint(vec![7; 100]).expect("room");
        assert!(store.get(&id).is_none() && store.get(&checkpoint).is_none());
        assert_eq!(held.upload(&id).expect("it is held").points.len(), 9);
        assert_eq!(account.used(), bytes + 100);
        drop(held);
        assert_eq!(account.used(), 100);

        let file = store.checkpoint(&checkpoint).expect("it is kept");
        store.insert(grid(2)).expect("room");
        assert!(store.checkpoint(&checkpoint).is_none(), "it is forgotten");
        assert_eq!((file.bytes().len(), account.used()), (100, 100 + size(&grid(2))));
        drop(file);
        assert_eq!(account.used(), size(&grid(2)));
    }

    #[test]
    fn a_scene_finds_its_frames_again_once_they_are_forgotten_and_they_count_until_then() {
        let account = MemoryAccount::of_server(1 << 30);
        let limits = Limits { max_meshes: 1, ..Limits::default() };
        let store = MeshStore::new(&limits, Arc::clone(&account));
        let frames = PointFrames { points: 2, places: Arc::from([[0.5_f32; 3]; 6]) };
        assert_eq!(frames.bytes(), 72);
        let id = store.insert_frames(frames.clone()).expect("room");
        let noted = Noted::new(&store);
        assert!(noted.upload(&id).is_none() && noted.uploaded_frames("frames-of-nobody").is_none());
        assert_eq!(noted.uploaded_frames(&id).expect("they are kept"), frames);
        let held = noted.into_held();
        let mesh = store.insert(grid(2)).expect("room");
        assert!(store.hold_frames(&id).is_none() && store.hold_frames(&mesh).is_none());
        assert_eq!(held.uploaded_frames(&id).expect("they are held"), frames);
        assert_eq!(account.used(), 72 + size(&grid(2)));
        drop(held);
        assert_eq!(account.used(), size(&grid(2)));
    }
}

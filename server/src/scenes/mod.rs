//! What sessions are made from: shipped scenes, scenes that clients send, meshes that they upload.

mod mesh_store;

pub(crate) use mesh_store::{MeshStore, build_scene, scene_names, shipped_scene};

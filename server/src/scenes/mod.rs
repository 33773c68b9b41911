//! What sessions are made from: shipped scenes, scenes that clients send, meshes that they upload.

mod mesh_store;
mod shipped;
mod estimate;
mod assemble;

pub(crate) use assemble::{Asked, Assembled, assemble_scene};
pub(crate) use mesh_store::MeshStore;
pub(crate) use shipped::{scene_names, shipped_scene};

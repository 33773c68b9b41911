//! What sessions are made from: shipped scenes, scenes that clients send, meshes and saved sessions that they upload.

mod mesh_store;
mod held_meshes;
mod shipped;
mod estimate;
mod assemble;
mod origin;

pub(crate) use assemble::{Asked, Assembled, Claimed, assemble_scene, claim_saved};
pub(crate) use mesh_store::{Checkpoint, MeshStore};
pub(crate) use origin::{Origin, Source};
pub(crate) use shipped::{scene_names, shipped_scene};

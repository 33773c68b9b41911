//! A scene to a world: checks, meshes, bodies, snow, colliders, first changes.
//!
//! Reads a [`Scene`] and what a [`MeshSource`] gives; writes a [`WorldSetup`] for the simulation.

mod meshes;
mod size;
mod names;
mod mass;
mod pins;
mod inside;
mod start;
mod repair;
mod units;
mod thickness;
mod collider;
mod stepping;
mod springs;
mod elements;
mod body;
mod snow;
mod estimate;
mod figure;
mod setup_size;
mod world;

pub use collider::ColliderSolid;
pub use estimate::SceneSize;
pub use meshes::{MeshSource, NoMeshes};
pub use pins::Layout;
pub use size::SceneLimits;
pub use world::Built;

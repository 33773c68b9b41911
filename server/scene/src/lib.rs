//! Scenes and meshes: text in, simulation out.
//!
//! A [`Scene`] is read from TOML and built into a [`nappe_sim::world::WorldSetup`]; meshes come
//! from formulas, uploads and files ([`mesh`]); [`course`] reads the MecaSim course's parameter
//! files. Every fault is a [`SceneError`]: file, line, column, field, what was found, what is
//! allowed. Only [`files`] opens files. Modules in reading order:

mod error;
mod source;
mod location;
mod names;
mod schema;
pub mod mesh;
mod body;
mod snow;
mod keys;
mod scene;
mod fill;
mod assemble;
mod shipped;
pub mod course;
pub mod files;

pub use body::{
    Body, Law, Limits, Mass, Mesh, MovingPin, Pattern, Pin, Plane, Rotate, Solver, Springs, Transform,
};
pub use assemble::{Built, MeshSource, NoMeshes, SceneLimits};
pub use error::{Fault, SceneError};
pub use keys::page as reference_page;
pub use scene::{ColliderText, Scene, ShapeText, VERSION};
pub use shipped::shipped_scenes;
pub use snow::{
    AdvectionName, BoxText, MaterialText, Sampling, Snow, SnowBody, SnowSolver, SnowSource, TransferName,
    VolumeFrom,
};
pub use source::Source;

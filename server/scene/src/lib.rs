//! Scenes and meshes: text in, simulation out.
//!
//! A [`Scene`] is read from TOML and built into a [`nappe_sim::world::WorldSetup`]; meshes come
//! from formulas, uploads and files ([`mesh`]); [`course`] reads the MecaSim course's parameter
//! files. What is wrong is a [`SceneError`]: file, line, column, key, what was found, what is
//! allowed. Only [`files`] opens files. Modules in reading order:

mod printable;
mod error;
mod utf8;
mod source;
mod location;
mod names;
mod schema;
pub mod mesh;
mod transform;
mod air;
mod contact;
mod rest;
mod solver;
mod element_law;
mod fabric;
mod body;
mod figure;
mod snow;
mod way;
mod collider;
mod keys;
mod scene;
mod edit;
mod terms;
mod uploads;
mod fill;
mod parts;
mod assemble;
mod shipped;
mod coarser;
pub mod course;
pub mod files;

pub use assemble::{Built, ColliderSolid, Layout, MeshSource, NoMeshes, SceneLimits, SceneSize};
pub use body::{
    Body, ForceText, GridPlane, Mass, Mesh, MeshRepair, MovingPin, Pattern, Pin, SpringLaw, Springs, Unused,
};
pub use coarser::{CoarserGrid, CoarserScene, coarser};
pub use collider::{ColliderMesh, ColliderText, ShapeText};
pub use edit::EditError;
pub use element_law::{ElementLaw, NamedWarp, Stiffness, WarpText};
pub use error::{ErrorKind, SceneError, SceneErrors, suggestion};
pub use fabric::{Fabric, FabricText};
pub use figure::{Figure, FigureFrames, FramesSource};
pub use keys::{page as reference_page, unit};
pub use mesh::enclosed_volume;
pub use parts::{MeshParts, PartOverlaps};
pub use printable::{is_printable, printable, printable_json};
pub use rest::Rest;
pub use scene::{Scene, VERSION, WindKey};
pub use shipped::shipped_scenes;
pub use snow::{
    AdvectionName, BoxText, MaterialText, Overlap, Sampling, Snow, SnowBody, SnowSolver, SnowSource,
    TransferName, VolumeFrom,
};
pub use solver::{Limits, Solver};
pub use source::Source;
pub use terms::{Removal, SceneTerm};
pub use transform::{Rotate, Transform};
pub use way::ColliderKey;

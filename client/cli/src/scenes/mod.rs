//! Scenes and meshes that the command line names, and those that it writes.
//!
//! Enters: names and files. Leaves: texts of scenes, meshes, and what is odd about them. Modules in reading order:

pub(crate) mod meshes;
pub(crate) mod mesh_files;
pub(crate) mod moving;
pub(crate) mod mesh_info;
pub(crate) mod scene;
pub(crate) mod scene_files;
pub(crate) mod saved;

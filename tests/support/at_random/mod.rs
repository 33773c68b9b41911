//! Scenes at random: a seed gives a scene as a user would write it, with the meshes beside it.
//!
//! Enters: a seed. Leaves: a case, which can be run, changed, made smaller, and written as files that `nappe run` takes. Modules in reading
//! order:

mod world;
mod case;
mod body;
mod collider;
mod snow;
mod scene;
mod shrink;

pub use case::Case;
pub use scene::of_seed;
pub use shrink::smallest;
pub use world::{Frame, Run, World, go_on};

//! What particles hit: signed distances, and the answer of a particle that touches one.

mod pose;
mod motion;
pub mod shape;
mod collider;
mod moving;
mod facing;
mod passed;
mod flight;
mod planes;
mod load;
mod touch;
mod crease;
mod answer;
mod approach;
mod pinch;
mod contact;
mod velocity;
mod corner;

pub use collider::{Collider, Contact, StartInside};
pub use load::LOAD_BYTES;
pub use motion::{Bounds, PoseKey, Way};
pub use pose::Pose;
pub use shape::Shape;

pub(crate) use approach::Approach;
pub(crate) use contact::{Contacts, Kept, Met, Passed, resolve};
pub(crate) use corner::{Corner, SAME_NORMAL};
pub(crate) use load::{BlockLoads, Carried, ChunkLoads, Felt, cleared};
pub(crate) use motion::{FASTEST, Motion, surface_speed};
pub(crate) use moving::Moved;
pub(crate) use passed::has_passed;
pub(crate) use pose::{turn_length, unit};
pub(crate) use touch::push_and_rub;
pub(crate) use velocity::velocity_after;

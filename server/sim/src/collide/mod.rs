//! What particles hit: signed distances, and the answer of a particle that touches one.

mod motion;
pub mod shape;
mod collider;
mod load;
mod cloth;
mod snow;

pub use collider::{Collider, Contact, StartInside};
pub use load::LOAD_BYTES;
pub use motion::pose::Pose;
pub use motion::{Bounds, PoseKey, Way};
pub use shape::Shape;

pub(crate) use cloth::approach::Approach;
pub(crate) use cloth::contact::{Contacts, Kept, Met, Passed, resolve};
pub(crate) use cloth::passed::has_passed;
pub(crate) use cloth::touch::push_and_rub;
pub(crate) use collider::moving::Moved;
pub(crate) use load::{BlockLoads, Carried, ChunkLoads, Felt, cleared};
pub(crate) use motion::pose::{turn_length, unit};
pub(crate) use motion::{FASTEST, Motion, surface_speed};
pub(crate) use snow::corner::{Corner, SAME_NORMAL};
pub(crate) use snow::velocity::velocity_after;

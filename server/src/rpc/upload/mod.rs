//! Uploads of meshes, as arrays or as files, in a stream or in calls of one message each.
//!
//! Enters: a header, then pieces. Leaves: a mesh that is kept, or the reason why it was refused.

mod layout;
mod assembly;
mod file;
mod patience;
mod incoming;
mod receive;
mod unary;

pub(super) use incoming::Header;
pub(crate) use patience::UploadTimes;
pub(super) use receive::{receive, with_reason};
pub(crate) use unary::UnaryUploads;

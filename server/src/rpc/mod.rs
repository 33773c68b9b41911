//! The methods of the service.
//!
//! Enters: requests, checked here. Leaves: messages, or a status with a reason.

mod validate;
mod lists;
mod collider_moves;
mod changes;
mod pending;
mod server_info;
mod upload;
mod request_ids;
mod shared;
mod create;
mod restore;
mod save;
mod links;
mod methods;

pub(crate) use methods::Methods;
pub(crate) use restore::restore;
pub(crate) use shared::Shared;
pub(crate) use upload::UploadTimes;

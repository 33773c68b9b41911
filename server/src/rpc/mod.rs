//! The methods of the service: requests are checked, turned into commands, and answered.

mod validate;
mod request_ids;
mod upload;
mod shared;
mod create;
mod methods;

pub(crate) use methods::Methods;
pub(crate) use shared::Shared;

//! Errors on their way to clients: the table of reasons, and the status that carries one.

mod reason;
mod service_error;

pub use reason::{DOMAIN, Reason, errors_page};
pub(crate) use service_error::{ServiceError, reason_of};

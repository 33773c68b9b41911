//! Errors on their way to clients: the table of reasons, and the error that carries one.

mod reason;
mod service_error;
mod simulation;
mod panic;

pub(crate) use panic::panic_message;
pub use reason::{DOMAIN, Reason, errors_page};
pub(crate) use service_error::ServiceError;
pub(crate) use simulation::step_reason;

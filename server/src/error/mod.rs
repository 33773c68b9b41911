//! Errors on their way to clients: each carries a reason of the contract's table.

mod service_error;
mod simulation;
mod panic;

pub use nappe_proto::{DOMAIN, Reason};
pub(crate) use panic::panic_message;
pub(crate) use service_error::ServiceError;
pub(crate) use simulation::step_reason;

//! Connections, and the layers that every call passes on its way to a method.

mod connections;
mod listener;
mod cors;
mod host;
mod request_deadline;
mod interceptor;
mod router;

pub(crate) use listener::{ListenerSettings, serve};
pub(crate) use router::router;

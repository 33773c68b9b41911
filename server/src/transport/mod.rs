//! Connections, and the layers that every call passes on its way to a method.

mod connections;
mod activity;
mod progress;
mod listener;
mod cors;
mod host;
mod request_deadline;
mod method;
mod rights;
mod token;
mod door;
mod answer;
mod elements;
mod guard;
mod interceptor;
mod grpc;
mod metrics;
#[cfg(feature = "page")]
mod page;
mod router;

pub(crate) use listener::{Listener, ListenerSettings, serve};
pub(crate) use router::router;

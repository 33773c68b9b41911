//! The compute server: sessions that step on their own threads, streamed over gRPC.
//!
//! [`App::start`] serves in the caller's tokio runtime: the program `nappe-server` does, the
//! command `nappe` does for a demonstration, and so does every test. Modules in reading order, each
//! using only those above it:

pub mod config;
mod error;
mod scenes;
mod stream;
mod session;
mod rpc;
mod transport;
mod app;
mod signals;

pub use app::{App, StartError};
pub use config::{Config, DEFAULT_PORT, Limits};
pub use error::{DOMAIN, Reason};
pub use signals::Signals;

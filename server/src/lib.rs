//! The compute server: sessions that step on their own threads, streamed over gRPC.
//!
//! [`App::start`] serves in the caller's tokio runtime: the program `nappe-server` does, the
//! command `nappe` does for a demonstration, and so does every test. Modules in reading order:

pub mod config;
pub mod reason;
mod error;
mod pack;
mod grid;
mod contents;
mod frame;
mod publish;
mod wire;
mod topology;
mod library;
mod upload;
mod watch;
mod validate;
mod session;
mod shared;
mod create;
mod service;
mod origin;
mod guard;
mod accept;
mod stack;
mod app;
mod signal;

pub use app::{App, StartError};
pub use config::{Config, DEFAULT_PORT, Limits};
pub use reason::{DOMAIN, Reason, errors_page};
pub use signal::Signals;

//! The compute server: sessions that step on their own threads, streamed over gRPC.
//!
//! [`App::start`] serves in the caller's tokio runtime: the program `nappe-server` does, the
//! command `nappe` does for a demonstration, and so does every test. Modules in reading order, each
//! using only those above it:

mod address;
mod caller;
mod processor;
mod machine;
mod program;
mod command_line;
pub mod numbers;
mod log;
pub mod config;
mod runtime;
pub mod state;
mod error;
mod memory;
mod counters;
mod refusals;
mod secret;
mod passes;
mod links;
mod trim;
mod scenes;
mod stream;
mod session;
mod rpc;
mod transport;
mod start_error;
mod token_keeper;
mod app;
mod signals;

pub use address::{Address, DEFAULT_PORT};
pub use app::App;
pub use command_line::{command_line, say};
pub use config::{Config, Limits, RankSettings, TokenPlace};
pub use error::{DOMAIN, Reason};
pub use log::{Log, LogError};
pub use processor::{MissingInstructions, check_processor};
pub use program::find_program;
pub use runtime::runtime;
pub use signals::{Signals, outlive_file_limits};
pub use start_error::StartError;

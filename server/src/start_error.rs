//! Why a server does not start.

use std::{io, path::PathBuf};

use thiserror::Error;

use crate::address::Address;

/// Longest time in a configuration: a day.
pub(crate) const MAX_SECONDS: f64 = 86_400.0;

/// Shortest time in which nothing may be heard of ranks (s): signs of life are 2 s apart.
pub(crate) const LEAST_RANK_SILENCE: u32 = 5;

/// A server that could not be started.
#[derive(Debug, Error)]
pub enum StartError {
    /// An address that other machines reach, without the flag.
    #[error(
        "refusing to listen on {0}: other machines could reach it, and there is no encryption: whoever listens \
         on the way reads the token. Listen on 127.0.0.1 and forward the port (`nappe connect`, ssh -L), or give \
         --allow-remote on a network that you trust"
    )]
    Remote(Address),
    /// The system refused the address.
    #[error("cannot listen on {address}: {source}")]
    Bind {
        /// The address that was asked for.
        address: Address,
        /// What the system answered.
        source: io::Error,
    },
    /// A time of the configuration outside its range.
    #[error("{name} is {value}: allowed are 0 to {MAX_SECONDS} seconds")]
    BadSeconds {
        /// The name of the setting.
        name: &'static str,
        /// The value that it has (s).
        value: f64,
    },
    /// A launcher of ranks that does not say where their number or their program stands.
    #[error("the launcher of ranks is '{0}': it needs both {{ranks}} and {{program}}")]
    Launcher(String),
    /// A silence of ranks that is shorter than signs of life are apart, or too long.
    #[error("rank_silence is {0}: allowed are {LEAST_RANK_SILENCE} to {MAX_SECONDS} seconds")]
    RankSilence(u32),
    /// No token can be read or drawn.
    #[error("there is no token to ask for: {0}")]
    Token(io::Error),
    /// The folder of sessions cannot be used.
    #[error("sessions cannot be kept in {}: {source}", path.display())]
    State {
        /// The folder that was asked for.
        path: PathBuf,
        /// What is wrong with it.
        source: io::Error,
    },
    /// The token can be left nowhere.
    #[error(
        "the token cannot be left where clients of this user find it: {0}. Set XDG_RUNTIME_DIR, or give \
         --token FILE, or --no-token to let everybody call who reaches the address"
    )]
    TokenFile(io::Error),
    /// The caller runs in no tokio runtime.
    #[error("the server runs in a tokio runtime, and there is none")]
    NoRuntime,
}

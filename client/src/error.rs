//! Errors of the client: what failed, where, and the server's own reason when it gave one.
//!
//! Enters: a `tonic::Status` or a transport error. Leaves: [`ClientError`].

use std::{collections::BTreeMap, fmt, io, time::Duration};

use nappe_proto::Reason;
use tonic::Code;
use tonic_types::StatusExt as _;

use crate::{decode::DecodeError, upload::MeshError};

/// Why a call or a stream failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of each variant says what its fields are")]
pub enum ClientError {
    /// The address is not one.
    #[error(
        "{address:?} is not the address of a server: {cause} (expected, for example, http://127.0.0.1:6277)"
    )]
    Address {
        address: String,
        /// What is wrong with it.
        cause: String,
    },
    /// Nothing answers at the address.
    #[error("no server answers at {endpoint}: {cause}")]
    Connect {
        endpoint: String,
        /// What the connection attempt met.
        cause: String,
    },
    /// The server refused the call.
    #[error("the server says: {0}")]
    Server(Box<ServerError>),
    /// The connection broke.
    #[error("the connection to {endpoint} broke: {cause}")]
    Transport { endpoint: String, cause: String },
    /// No answer in time.
    #[error("{endpoint} did not answer {method} within {} s", limit.as_secs_f64())]
    Deadline {
        endpoint: String,
        method: &'static str,
        /// How long it was given.
        limit: Duration,
    },
    /// The stream holds bytes that make no frame.
    #[error("the server's stream does not decode: {0}")]
    Decode(#[from] DecodeError),
    /// The answer lacks a part that the contract promises.
    #[error("the server's answer to {method} lacks its {what}")]
    Incomplete { method: &'static str, what: &'static str },
    /// The stream stopped without saying that the session ended.
    #[error("the stream of session {session_id:?} stopped without its end")]
    Truncated { session_id: String },
    /// The mesh cannot be sent.
    #[error("mesh {name:?}: {source}")]
    Mesh {
        name: String,
        /// What is wrong with it.
        source: MeshError,
    },
}

impl ClientError {
    /// The gRPC code, when the server or the transport gave one.
    pub fn code(&self) -> Option<Code> {
        match self {
            Self::Server(error) => Some(error.code),
            Self::Connect { .. } | Self::Transport { .. } => Some(Code::Unavailable),
            Self::Deadline { .. } => Some(Code::DeadlineExceeded),
            _ => None,
        }
    }

    /// The server's reason (`ErrorInfo.reason`, listed in docs/errors.md), for example `SESSION_NOT_FOUND`.
    pub fn reason(&self) -> Option<&str> {
        self.server().and_then(|error| error.reason.as_deref())
    }

    /// The server's reason as a constant to branch on; none if it gave none, or one that this client is too old to
    /// know.
    pub fn known_reason(&self) -> Option<Reason> {
        self.reason().and_then(Reason::of)
    }

    /// What the server said, when it is the server that refused.
    pub fn server(&self) -> Option<&ServerError> {
        match self {
            Self::Server(error) => Some(error),
            _ => None,
        }
    }

    /// True if the same call may succeed later: the server is away, draining or restarting.
    pub fn is_transient(&self) -> bool {
        matches!(self.code(), Some(Code::Unavailable | Code::DeadlineExceeded))
    }

    /// Reads a status: one made by the transport has a source, one sent by the server has none.
    pub(crate) fn from_status(status: &tonic::Status, endpoint: &str) -> Self {
        match std::error::Error::source(status) {
            Some(source) => {
                let (endpoint, last) = (endpoint.to_owned(), innermost(source));
                let cause = last.to_string();
                if nobody_listens(last) {
                    Self::Connect { endpoint, cause }
                } else {
                    Self::Transport { endpoint, cause }
                }
            }
            None => Self::Server(Box::new(ServerError::from_status(status))),
        }
    }
}

/// A refusal, as the server words it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServerError {
    /// Status code of gRPC.
    pub code: Code,
    /// Reason (`ErrorInfo.reason`); every error of a nappe server has one.
    pub reason: Option<String>,
    /// The whole story.
    pub message: String,
    /// The values named in the message.
    pub metadata: BTreeMap<String, String>,
}

impl ServerError {
    fn from_status(status: &tonic::Status) -> Self {
        let info = status.get_details_error_info();
        let (reason, metadata) = match info {
            Some(info) => (Some(info.reason), info.metadata.into_iter().collect()),
            None => (None, BTreeMap::new()),
        };
        Self { code: status.code(), reason, message: status.message().to_owned(), metadata }
    }
}

impl fmt::Display for ServerError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.message.is_empty() {
            f.write_str(self.code.description())?;
        } else {
            f.write_str(&self.message)?;
        }
        match &self.reason {
            Some(reason) => write!(f, " ({reason})"),
            None => write!(f, " ({:?})", self.code),
        }
    }
}

impl std::error::Error for ServerError {}

/// Whether an error says that no program listens at an address, or that no socket is at a path.
fn nobody_listens(error: &(dyn std::error::Error + 'static)) -> bool {
    let kind = error.downcast_ref::<io::Error>().map(io::Error::kind);
    matches!(kind, Some(io::ErrorKind::ConnectionRefused | io::ErrorKind::NotFound))
}

/// The last error of a chain: "connection refused" rather than "transport error".
pub(crate) fn innermost<'a>(
    error: &'a (dyn std::error::Error + 'static),
) -> &'a (dyn std::error::Error + 'static) {
    let mut last = error;
    while let Some(next) = last.source() {
        last = next;
    }
    last
}

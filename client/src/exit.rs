//! Exit codes of the programs that use this library, `nappe` and `nappe-viewer`.
//!
//! Enters: an error of the client. Leaves: the code that scripts see.

use nappe_proto::Reason;

use crate::error::ClientError;

/// How a program ends, as scripts see it. `nappe --help` lists them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Exit {
    /// Something failed that has no code of its own: a file, a scene, a mesh.
    Failure = 1,
    /// The command line asks for something that does not exist.
    Usage = 2,
    /// The simulation left what its scene allows.
    Diverged = 3,
    /// No server answers at the address.
    Unreachable = 4,
    /// The server answered and refused.
    Refused = 5,
    /// Ctrl-C, SIGTERM, or a terminal that closed.
    Interrupted = 130,
}

impl From<&ClientError> for Exit {
    fn from(error: &ClientError) -> Self {
        match error {
            ClientError::Address { .. } => Self::Usage,
            ClientError::Connect { .. } | ClientError::Transport { .. } | ClientError::Deadline { .. } => {
                Self::Unreachable
            }
            ClientError::Server(_) if error.known_reason().is_some_and(Reason::is_divergence) => {
                Self::Diverged
            }
            ClientError::Server(_) => Self::Refused,
            _ => Self::Failure,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_that_is_none_is_a_wrong_command_line_and_silence_an_unreachable_server() {
        let address = ClientError::Address { address: "x".to_owned(), cause: "y".to_owned() };
        let silent = ClientError::Connect { endpoint: "x".to_owned(), cause: "y".to_owned() };
        assert_eq!([Exit::from(&address), Exit::from(&silent)], [Exit::Usage, Exit::Unreachable]);
    }
}

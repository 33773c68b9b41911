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
    /// Ctrl-C or SIGTERM.
    Interrupted = 130,
}

impl Exit {
    /// The exit code that a program ended with, if it is one of these.
    pub fn of(code: i32) -> Option<Self> {
        let all =
            [Self::Failure, Self::Usage, Self::Diverged, Self::Unreachable, Self::Refused, Self::Interrupted];
        all.into_iter().find(|exit| *exit as i32 == code)
    }
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
    fn a_code_is_found_again_and_others_are_none() {
        for exit in [Exit::Failure, Exit::Usage, Exit::Diverged, Exit::Unreachable, Exit::Refused] {
            assert_eq!(Exit::of(exit as i32), Some(exit));
        }
        assert_eq!((Exit::of(130), Exit::of(0), Exit::of(101)), (Some(Exit::Interrupted), None, None));
    }

    #[test]
    fn an_address_that_is_none_is_a_wrong_command_line_and_silence_an_unreachable_server() {
        let address = ClientError::Address { address: "x".to_owned(), cause: "y".to_owned() };
        let silent = ClientError::Connect { endpoint: "x".to_owned(), cause: "y".to_owned() };
        assert_eq!([Exit::from(&address), Exit::from(&silent)], [Exit::Usage, Exit::Unreachable]);
    }
}

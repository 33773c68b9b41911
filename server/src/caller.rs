//! Who is at the other end of a connection, as the log tells it.

use std::{fmt, net::SocketAddr};

use http::Extensions;

/// The other end of a connection, which goes with each of its requests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Caller {
    Tcp(SocketAddr),
    /// Somebody who may open the Unix socket.
    #[default]
    Unix,
}

impl Caller {
    /// The caller of a request.
    pub(crate) fn of(request: &Extensions) -> Self {
        request.get().copied().unwrap_or_default()
    }

    /// Whether it is on another machine, or reaches the server as if it were.
    pub(crate) fn is_elsewhere(self) -> bool {
        match self {
            Self::Tcp(address) => !address.ip().to_canonical().is_loopback(),
            Self::Unix => false,
        }
    }
}

impl fmt::Display for Caller {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(address) => {
                write!(f, "{}", SocketAddr::new(address.ip().to_canonical(), address.port()))
            }
            Self::Unix => f.write_str("unix"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn callers_are_here_or_elsewhere() {
        let caller = |address: &str| Caller::Tcp(address.parse().expect("an address"));
        for (address, is_elsewhere, told) in [
            ("127.0.0.1:4711", false, "127.0.0.1:4711"),
            ("127.0.0.66:1", false, "127.0.0.66:1"),
            ("[::1]:4711", false, "[::1]:4711"),
            ("[::ffff:127.0.0.1]:4711", false, "127.0.0.1:4711"),
            ("192.0.2.7:4711", true, "192.0.2.7:4711"),
            ("[::ffff:192.0.2.7]:4711", true, "192.0.2.7:4711"),
            ("[2001:db8::7]:4711", true, "[2001:db8::7]:4711"),
        ] {
            let caller = caller(address);
            assert_eq!((caller.is_elsewhere(), caller.to_string()), (is_elsewhere, told.to_owned()));
        }
        assert!(!Caller::Unix.is_elsewhere());
        assert_eq!(Caller::of(&Extensions::new()).to_string(), "unix");
    }
}

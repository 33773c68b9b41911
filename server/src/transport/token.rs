//! Who may call: whoever shows the token, or one that a link to a session gave. What does not never reaches a method.

use std::{sync::Arc, time::Instant};

use http::{HeaderMap, header};
use nappe_proto::token::Token;
use subtle::ConstantTimeEq as _;

use super::{method::Method, rights::right};
use crate::{
    error::{Reason, ServiceError},
    passes::{Passes, Right, Visitor, too_narrow},
};

/// How a token is sent, in the header `authorization`.
const SCHEME: &str = "bearer ";

/// Lets calls in that show the token, or that of a pass which allows the method.
#[derive(Clone, Debug)]
pub(super) struct Guard {
    token: Option<Token>,
    passes: Arc<Passes>,
}

impl Guard {
    /// Asks for this token, or for that of a pass; without one, lets everybody in.
    pub(super) fn new(token: Option<Token>, passes: Arc<Passes>) -> Self {
        Self { token, passes }
    }

    /// Lets a call in that shows the server's token, that of a pass which allows the method, or none where none is needed.
    ///
    /// # Errors
    /// If the call may not come in.
    pub(super) fn admit(&self, headers: &HeaderMap, method: &Method) -> Result<Visitor, ServiceError> {
        let Some(token) = self.token.as_ref().filter(|_| !method.needs_no_token()) else {
            return Ok(Visitor::default());
        };

        let Some(shown) = headers.get(header::AUTHORIZATION).and_then(|value| bearer(value.as_bytes()))
        else {
            let message = "this server asks for a token, in the header 'authorization: Bearer TOKEN'";
            return Err(ServiceError::new(Reason::TokenMissing, message));
        };
        // The time of the comparison tells nothing of where the two differ.
        if bool::from(token.reveal().as_bytes().ct_eq(shown)) {
            return Ok(Visitor::default());
        }
        let Some(pass) = self.passes.find(shown, Instant::now()) else {
            return Err(ServiceError::new(Reason::TokenWrong, "the token is not the one of this server"));
        };
        match right(method) {
            Right::Never => {
                let message =
                    format!("your link is for one session and copies of it, and not for {}", method.path());
                Err(too_narrow(message).with("method", method.path()))
            }
            right => Ok(Visitor::new(pass, right)),
        }
    }

    /// Whether a call of a method that is let in has shown the token.
    pub(super) fn has_seen_it(&self, method: &Method) -> bool {
        self.token.is_some() && !method.needs_no_token()
    }
}

/// The token in a value of the header.
fn bearer(value: &[u8]) -> Option<&[u8]> {
    let (scheme, token) = value.split_at_checked(SCHEME.len())?;
    scheme.eq_ignore_ascii_case(SCHEME.as_bytes()).then_some(token)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::secret::draw;

    #[test]
    fn the_token_alone_lets_a_call_in() {
        let token = draw().expect("random numbers");
        let right = format!("Bearer {}", token.reveal());
        let guard = Guard::new(Some(token), Arc::default());
        let method = Method::new("/nappe.v1.SimulationService/GetServerInfo");
        let reason = |value: Option<&str>| {
            let mut headers = HeaderMap::new();
            headers.extend(value.map(|value| (header::AUTHORIZATION, value.parse().expect("a header"))));
            guard.admit(&headers, &method).err().map(|error| error.reason)
        };
        assert_eq!(reason(Some(&right)), None);
        assert_eq!(reason(Some(&right.replacen("Bearer", "bearer", 1))), None);
        for missing in [None, Some(""), Some("Bearer"), Some("Basic dXNlcjpwYXNz"), Some(&right[7..])] {
            assert_eq!(reason(missing), Some(Reason::TokenMissing), "{missing:?}");
        }
        let longer = format!("{right}0");
        for wrong in ["Bearer ", &right[..right.len() - 1], &longer, &right.to_uppercase()] {
            assert_eq!(reason(Some(wrong)), Some(Reason::TokenWrong), "{wrong}");
        }

        let check = Method::new("/grpc.health.v1.Health/Check");
        assert!(guard.admit(&HeaderMap::new(), &check).is_ok(), "probes have no token");
        let watch = Method::new("/grpc.health.v1.Health/Watch");
        assert!(guard.admit(&HeaderMap::new(), &watch).is_err(), "a stream takes a place");
        let link = |method: &str| Method::new(&format!("/nappe.v1.SimulationService/{method}"));
        assert!(guard.admit(&HeaderMap::new(), &link("OpenLink")).is_ok(), "a code is shown for the token");
        assert!(guard.admit(&HeaderMap::new(), &link("MakeLink")).is_err());
        assert!(guard.has_seen_it(&method) && !guard.has_seen_it(&check));
        assert!(
            !guard.has_seen_it(&link("OpenLink")) && !Guard::new(None, Arc::default()).has_seen_it(&method)
        );
        assert!(Guard::new(None, Arc::default()).admit(&HeaderMap::new(), &method).is_ok());
    }
}

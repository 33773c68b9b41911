//! Who may call: whoever shows the token. What does not never reaches a method.

use http::{HeaderMap, header};
use nappe_proto::token::Token;
use subtle::ConstantTimeEq as _;

use super::method::Method;
use crate::error::{Reason, ServiceError};

/// How a token is sent, in the header `authorization`.
const SCHEME: &str = "bearer ";

/// Lets calls in that show the token.
#[derive(Clone, Debug)]
pub(super) struct Guard(Option<Token>);

impl Guard {
    /// Asks for this token; without one, lets everybody in.
    pub(super) fn new(token: Option<Token>) -> Self {
        Self(token)
    }

    /// Why a call may not come in, if so.
    pub(super) fn refusal(&self, headers: &HeaderMap, method: &Method) -> Option<ServiceError> {
        let token = self.0.as_ref()?;
        if method.needs_no_token() {
            return None;
        }

        let Some(shown) = headers.get(header::AUTHORIZATION).and_then(|value| bearer(value.as_bytes()))
        else {
            let message = "this server asks for a token, in the header 'authorization: Bearer TOKEN'";
            return Some(ServiceError::new(Reason::TokenMissing, message));
        };
        // The time of the comparison tells nothing of where the two differ.
        let is_known = bool::from(token.reveal().as_bytes().ct_eq(shown));
        (!is_known).then(|| ServiceError::new(Reason::TokenWrong, "the token is not the one of this server"))
    }

    /// Whether a call of a method that is let in has shown the token.
    pub(super) fn has_seen_it(&self, method: &Method) -> bool {
        self.0.is_some() && !method.needs_no_token()
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
        let guard = Guard::new(Some(token));
        let method = Method::new("/nappe.v1.SimulationService/GetServerInfo");
        let reason = |value: Option<&str>| {
            let mut headers = HeaderMap::new();
            headers.extend(value.map(|value| (header::AUTHORIZATION, value.parse().expect("a header"))));
            guard.refusal(&headers, &method).map(|error| error.reason)
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
        assert!(guard.refusal(&HeaderMap::new(), &check).is_none(), "probes have no token");
        let watch = Method::new("/grpc.health.v1.Health/Watch");
        assert!(guard.refusal(&HeaderMap::new(), &watch).is_some(), "a stream takes a place");
        let link = |method: &str| Method::new(&format!("/nappe.v1.SimulationService/{method}"));
        assert!(
            guard.refusal(&HeaderMap::new(), &link("OpenLink")).is_none(),
            "a code is shown for the token"
        );
        assert!(guard.refusal(&HeaderMap::new(), &link("MakeLink")).is_some());
        assert!(guard.has_seen_it(&method) && !guard.has_seen_it(&check));
        assert!(!guard.has_seen_it(&link("OpenLink")) && !Guard::new(None).has_seen_it(&method));
        assert!(Guard::new(None).refusal(&HeaderMap::new(), &method).is_none());
    }
}

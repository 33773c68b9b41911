//! Where a server is, and what to show it: from what was typed to an endpoint and a token.
//!
//! Enters: an address, and a token if the caller has one. Leaves: an endpoint, and what puts the token on every
//! call. Without a token, that of a server of the same user on the same machine is found by its port.

use std::{
    net::{IpAddr, SocketAddr},
    sync::Arc,
};

use nappe_proto::token::{LocalServer, Token, local_servers};
use tonic::{
    Request, Status,
    metadata::{Ascii, MetadataValue},
    service::Interceptor,
    transport::Endpoint,
};

use crate::error::{ClientError, innermost};

/// Whom requests over a Unix socket are addressed to.
const UNIX_ORIGIN: &str = "http://localhost";

/// A server that can be connected to.
#[derive(Debug)]
pub(crate) struct Target {
    pub(crate) endpoint: Endpoint,
    /// The address in words.
    pub(crate) address: Arc<str>,
    pub(crate) bearer: Bearer,
}

impl Target {
    /// Reads an address: `http://HOST:PORT`, `HOST:PORT` or `unix:PATH`.
    ///
    /// # Errors
    /// If it is none.
    pub(crate) fn new(typed: &str, token: Option<&Token>) -> Result<Self, ClientError> {
        let refuse = |cause: String| ClientError::Address { address: typed.to_owned(), cause };
        let endpoint = |address: &str| {
            let endpoint = Endpoint::from_shared(address.to_owned());
            endpoint.map_err(|error| refuse(innermost(&error).to_string()))
        };
        let given = Bearer::showing(token);
        if typed.starts_with("unix:") {
            let origin = UNIX_ORIGIN.parse().expect("it is an address");
            return Ok(Self {
                endpoint: endpoint(typed)?.origin(origin),
                address: typed.into(),
                bearer: given,
            });
        }

        let address = if typed.contains("://") { typed.to_owned() } else { format!("http://{typed}") };
        let target = endpoint(&address)?;
        if target.uri().scheme_str() != Some("http") {
            return Err(refuse("only http:// and unix: are spoken; put TLS in a proxy".to_owned()));
        }
        let (host, port) = (target.uri().host().unwrap_or_default(), target.uri().port_u16().unwrap_or(80));
        let (endpoint, address, bearer) = match (token, host) {
            (Some(_), _) => (target, address, given),
            // The name means two addresses, and somebody else may listen on one of them.
            (None, "localhost") => match local_servers(port).first() {
                None => (target, address, given),
                Some(server) => {
                    let address = format!("http://{}", server.address);
                    (endpoint(&address)?, address, Bearer::of(server.address))
                }
            },
            (None, host) => match host.trim_matches(['[', ']']).parse::<IpAddr>() {
                Ok(ip) if ip.is_loopback() => (target, address, Bearer::of(SocketAddr::new(ip, port))),
                _ => (target, address, given),
            },
        };
        Ok(Self { endpoint, address: address.into(), bearer })
    }
}

/// Puts a token on every call.
#[derive(Clone)]
pub(crate) struct Bearer(Source);

/// Where the token is from.
#[derive(Clone)]
enum Source {
    /// The caller, who may have none.
    Given(Option<MetadataValue<Ascii>>),
    /// A server of this user that lives, found again for every call: one that is started again has another token,
    /// and one that is gone is shown none.
    Found(SocketAddr),
}

impl Bearer {
    fn showing(token: Option<&Token>) -> Self {
        Self(Source::Given(token.map(header)))
    }

    fn of(address: SocketAddr) -> Self {
        Self(Source::Found(address))
    }

    fn value(&self) -> Option<MetadataValue<Ascii>> {
        match &self.0 {
            Source::Given(value) => value.clone(),
            Source::Found(address) => find(*address),
        }
    }
}

impl std::fmt::Debug for Bearer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Bearer(secret)")
    }
}

impl Interceptor for Bearer {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        if let Some(value) = self.value() {
            request.metadata_mut().insert("authorization", value);
        }
        Ok(request)
    }
}

/// The token of the server of this user that listens there.
fn find(address: SocketAddr) -> Option<MetadataValue<Ascii>> {
    let is_it = |server: &LocalServer| server.address == address;
    local_servers(address.port()).into_iter().find(is_it).map(|server| header(&server.token))
}

/// The header that shows a token, which is not printed and not kept by the compression of headers.
fn header(token: &Token) -> MetadataValue<Ascii> {
    let value = format!("Bearer {}", token.reveal()).parse();
    let mut value: MetadataValue<Ascii> = value.expect("a token is printable ASCII");
    value.set_sensitive(true);
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_urls_or_paths_and_tokens_are_never_printed() {
        let token = Token::parse("0123456789abcdef").expect("a token");
        for good in ["http://127.0.0.1:6277", "127.0.0.1:6277", "localhost:6277", "unix:/run/nappe.sock"] {
            let target = Target::new(good, Some(&token)).expect(good);
            assert!(!format!("{target:?}").contains(token.reveal()), "{target:?}");
            let mut bearer = target.bearer.clone();
            let request = bearer.call(Request::new(())).expect("never refused");
            let shown = request.metadata().get("authorization").expect("shown");
            assert_eq!(shown, "Bearer 0123456789abcdef");
            assert!(shown.is_sensitive() && !format!("{request:?}").contains(token.reveal()));
        }
        for bad in ["https://127.0.0.1:6277", "ftp://x", "", "http://"] {
            Target::new(bad, None).expect_err(bad);
        }
    }

    #[test]
    fn a_server_of_another_machine_is_shown_no_token_that_was_not_given() {
        for far in ["http://192.0.2.1:6277", "http://server.example:6277", "unix:/run/nappe.sock"] {
            let target = Target::new(far, None).expect("an address");
            assert!(matches!(target.bearer.0, Source::Given(None)), "{far}");
        }
    }
}

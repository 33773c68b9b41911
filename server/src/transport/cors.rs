//! Which web pages may call the server: those served from loopback, and those of configured origins. Whether a page is the
//! server's own is told by the host that its requests name, and needs no leave of CORS.
//!
//! A page of any origin can send requests to a server on its visitor's machine; without this
//! check, every page on the web could drive simulations there.

use std::{net::IpAddr, sync::Arc, time::Duration};

use http::{HeaderName, HeaderValue, Method, Uri, header};
use tower_http::cors::{AllowOrigin, CorsLayer};

/// Headers in which gRPC-Web clients find a call's status.
const STATUS_HEADERS: [&str; 3] = ["grpc-status", "grpc-message", "grpc-status-details-bin"];
/// Headers that gRPC-Web clients send.
const CALL_HEADERS: [&str; 5] =
    ["x-grpc-web", "x-user-agent", "grpc-timeout", "content-type", "authorization"];

/// The configured origins; loopback is always allowed.
#[derive(Clone, Debug, Default)]
pub(super) struct AllowedOrigins(Arc<[String]>);

impl AllowedOrigins {
    /// Loopback, and `extra`: each scheme://host:port, without a path.
    pub(super) fn new(extra: &[String]) -> Self {
        Self(extra.iter().map(|origin| origin.trim_end_matches('/').to_ascii_lowercase()).collect())
    }

    /// Whether pages of `origin` may call.
    pub(super) fn allow(&self, origin: &HeaderValue) -> bool {
        let Ok(origin) = origin.to_str() else { return false };
        let origin = origin.to_ascii_lowercase();
        self.0.contains(&origin) || is_loopback(&origin)
    }
}

/// Answers preflight requests, and marks answers that pages may read.
pub(super) fn cors_layer(origins: AllowedOrigins) -> CorsLayer {
    let allow = move |origin: &HeaderValue, _: &http::request::Parts| origins.allow(origin);
    CorsLayer::new()
        .allow_origin(AllowOrigin::predicate(allow))
        .allow_methods([Method::POST])
        .allow_headers(CALL_HEADERS.map(HeaderName::from_static))
        .expose_headers(STATUS_HEADERS.map(HeaderName::from_static))
        .vary([header::ORIGIN])
        .max_age(Duration::from_hours(1))
}

fn is_loopback(origin: &str) -> bool {
    let Ok(uri) = origin.parse::<Uri>() else { return false };
    let Some(host) = uri.host() else { return false };
    let address = host.trim_start_matches('[').trim_end_matches(']');
    host == "localhost" || address.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loopback_and_named_origins_are_allowed_and_no_others() {
        let origins = AllowedOrigins::new(&["https://viewer.example:8443/".to_owned()]);
        let allow = |origin: &str| origins.allow(&origin.parse().expect("a header"));
        for good in [
            "http://localhost",
            "http://localhost:5173",
            "http://127.0.0.1:80",
            "http://[::1]:5173",
            "https://Viewer.example:8443",
        ] {
            assert!(allow(good), "{good}");
        }

        for bad in [
            "null",
            "",
            "https://viewer.example",
            "http://localhost.evil.example",
            "http://127.0.0.1.evil.example",
            "http://10.0.0.1",
        ] {
            assert!(!allow(bad), "{bad}");
        }
    }
}

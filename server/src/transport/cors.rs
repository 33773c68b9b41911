//! Which web origins may call the server: pages served from loopback, and those that it was told.
//!
//! A page of any origin can send requests to a server on its visitor's machine; without this
//! check, every page on the web could drive simulations there.

use std::{net::IpAddr, sync::Arc};

use http::{HeaderValue, Uri};

/// Origins that are allowed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Origins(Arc<[String]>);

impl Origins {
    /// Loopback, and `extra` (scheme://host:port, without a path).
    pub(crate) fn new(extra: &[String]) -> Self {
        Self(extra.iter().map(|origin| origin.trim_end_matches('/').to_ascii_lowercase()).collect())
    }

    /// Whether pages of `origin` may call.
    pub(crate) fn allow(&self, origin: &HeaderValue) -> bool {
        let Ok(origin) = origin.to_str() else { return false };
        let origin = origin.to_ascii_lowercase();
        self.0.contains(&origin) || is_loopback(&origin)
    }
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
        let origins = Origins::new(&["https://viewer.example:8443/".to_owned()]);
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

//! Which hosts a request may be addressed to: those that are the server's own.
//!
//! A web page can have its own name resolve to this machine (DNS rebinding), and its requests then count as
//! going to the page's own origin. They still carry the page's name as their host.

use std::{net::IpAddr, sync::Arc};

use http::{Request, header, uri::Authority};

/// Names besides addresses and `localhost`, in lower case.
#[derive(Clone, Debug, Default)]
pub(super) struct AllowedHosts(Arc<[String]>);

impl AllowedHosts {
    /// The machine's own name, and `extra`.
    pub(super) fn new(extra: &[String]) -> Self {
        let own = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
        let own = own.iter().map(|name| name.trim());
        Self(own.chain(extra.iter().map(String::as_str)).map(str::to_ascii_lowercase).collect())
    }

    /// Whether a request is addressed to this server; otherwise the host that it names, as it stands there.
    pub(super) fn check<B>(&self, request: &Request<B>) -> Result<(), String> {
        let named = match request.uri().authority() {
            Some(authority) => authority.as_str().to_owned(),
            None => match request.headers().get(header::HOST) {
                Some(host) => String::from_utf8_lossy(host.as_bytes()).into_owned(),
                // HTTP/1.0: browsers speak later versions.
                None => return Ok(()),
            },
        };
        let allowed = named.parse::<Authority>().is_ok_and(|authority| self.allow(authority.host()));
        if allowed { Ok(()) } else { Err(named) }
    }

    /// An address cannot be rebound: only names are.
    fn allow(&self, host: &str) -> bool {
        let host = host.trim_end_matches('.').to_ascii_lowercase();
        let address = host.trim_start_matches('[').trim_end_matches(']');
        host == "localhost"
            || host.ends_with(".localhost")
            || address.parse::<IpAddr>().is_ok()
            || self.0.contains(&host)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_and_own_names_are_allowed_and_no_others() {
        let hosts = AllowedHosts::new(&["Node7.cluster.example".to_owned()]);
        let check = |host: &str| {
            let request =
                Request::builder().uri("/x").header(header::HOST, host).body(()).expect("a request");
            hosts.check(&request)
        };
        for good in [
            "127.0.0.1:50051",
            "[::1]:50051",
            "192.0.2.7:50051",
            "localhost",
            "LOCALHOST.:50051",
            "nappe.localhost:1",
            "node7.cluster.example:50051",
        ] {
            assert_eq!(check(good), Ok(()), "{good}");
        }

        for bad in ["evil.example:50051", "127.0.0.1.evil.example", "localhost.evil.example", "", "a b"] {
            assert_eq!(check(bad), Err(bad.to_owned()), "{bad}");
        }

        let request = Request::builder().uri("http://evil.example:50051/x").body(()).expect("a request");
        assert_eq!(hosts.check(&request), Err("evil.example:50051".to_owned()), "the authority of HTTP/2");
    }
}

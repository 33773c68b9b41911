//! Which hosts a request may be addressed to: those that are the server's own.
//!
//! A web page can have its own name resolve to this machine (DNS rebinding), and its requests then count as
//! going to the page's own origin. They still carry the page's name as their host.

use std::{net::IpAddr, sync::Arc};

use http::{HeaderValue, Request, Uri, header, uri::Authority};

use crate::address::Address;

/// Names besides addresses and `localhost`, in lower case. None where every host is as good as any other.
#[derive(Clone, Debug)]
pub(super) struct AllowedHosts(Option<Arc<[String]>>);

impl AllowedHosts {
    /// Of a server at an address: the machine's own name, and `extra`. No web page reaches a Unix socket, and its callers
    /// name whatever host they like.
    pub(super) fn new(address: &Address, extra: &[String]) -> Self {
        if matches!(address, Address::Unix(_)) {
            return Self(None);
        }
        let own = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
        let own = own.iter().map(|name| name.trim());
        Self(Some(own.chain(extra.iter().map(String::as_str)).map(str::to_ascii_lowercase).collect()))
    }

    /// Whether a request is addressed to this server; otherwise the host that it names, as it stands there, and nothing if it
    /// names none. One that names its host twice, as authority and in a header, has to name the same one.
    pub(super) fn check<B>(&self, request: &Request<B>) -> Result<(), String> {
        let Some(names) = &self.0 else { return Ok(()) };
        let mut hosts = Vec::new();
        for named in named_hosts(request) {
            match host_of(&named).filter(|host| is_allowed(names, host)) {
                Some(host) => hosts.push((host, named)),
                None => return Err(named),
            }
        }
        match hosts.windows(2).find(|pair| pair[0].0 != pair[1].0) {
            Some(pair) => Err(format!("{} and {}", pair[0].1, pair[1].1)),
            None if hosts.is_empty() => Err(String::new()),
            None => Ok(()),
        }
    }

    /// Whether a page of `origin` was loaded from where the request goes, so that it is the server's own: [`Self::check`] has
    /// let the request in. No page is loaded from a Unix socket, whose every host is allowed.
    pub(super) fn is_own_origin<B>(&self, request: &Request<B>, origin: &HeaderValue) -> bool {
        let Some(origin) = self.0.as_ref().and_then(|_| origin.to_str().ok()?.parse::<Uri>().ok()) else {
            return false;
        };
        let usual = match origin.scheme_str() {
            Some("http") => 80,
            Some("https") => 443,
            _ => return false,
        };
        let place = |authority: &Authority| {
            (authority.host().to_ascii_lowercase(), authority.port_u16().unwrap_or(usual))
        };
        let named = named_hosts(request);
        let is_same = |named: &String| {
            let named = named.parse::<Authority>().ok();
            named.is_some_and(|named| origin.authority().map(place) == Some(place(&named)))
        };
        !named.is_empty() && named.iter().all(is_same)
    }
}

/// The hosts that a request names, with their ports: as authority, and in headers.
fn named_hosts<B>(request: &Request<B>) -> Vec<String> {
    let authority = request.uri().authority().map(|authority| authority.as_str().to_owned());
    let headers = request.headers().get_all(header::HOST).iter();
    let headers = headers.map(|host| String::from_utf8_lossy(host.as_bytes()).into_owned());
    authority.into_iter().chain(headers).collect()
}

/// The host of an authority, in lower case and without the dot of the root. A host has no user.
fn host_of(named: &str) -> Option<String> {
    let authority: Authority = named.parse().ok().filter(|_| !named.contains('@'))?;
    Some(authority.host().trim_end_matches('.').to_ascii_lowercase())
}

/// An address cannot be rebound: only names are.
fn is_allowed(names: &[String], host: &str) -> bool {
    let address = host.trim_start_matches('[').trim_end_matches(']');
    host == "localhost"
        || host.ends_with(".localhost")
        || address.parse::<IpAddr>().is_ok()
        || names.iter().any(|name| name == host)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_and_own_names_are_allowed_and_no_others() {
        let hosts = AllowedHosts::new(&Address::default(), &["Node7.cluster.example".to_owned()]);
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

        for bad in [
            "evil.example:50051",
            "127.0.0.1.evil.example",
            "localhost.evil.example",
            "evil@127.0.0.1",
            "evil:word@localhost:50051",
            "",
            "a b",
        ] {
            assert_eq!(check(bad), Err(bad.to_owned()), "{bad}");
        }
        let none = Request::builder().uri("/x").body(()).expect("a request");
        assert_eq!(hosts.check(&none), Err(String::new()), "it names none");

        let request = Request::builder().uri("http://evil.example:50051/x").body(()).expect("a request");
        assert_eq!(hosts.check(&request), Err("evil.example:50051".to_owned()), "the authority of HTTP/2");
    }

    #[test]
    fn a_request_that_names_two_hosts_is_refused_unless_they_are_the_same() {
        let hosts = AllowedHosts::new(&Address::default(), &[]);
        let check = |authority: &str, header: &str| {
            let request =
                Request::builder().uri(format!("http://{authority}/x")).header(header::HOST, header);
            hosts.check(&request.body(()).expect("a request"))
        };
        assert_eq!(check("localhost:1", "LOCALHOST."), Ok(()));
        assert_eq!(check("127.0.0.1:1", "127.0.0.1:1"), Ok(()));
        assert_eq!(check("localhost:1", "evil.example"), Err("evil.example".to_owned()));
        assert_eq!(check("evil.example", "localhost"), Err("evil.example".to_owned()));
        assert_eq!(check("localhost:1", "127.0.0.1:1"), Err("localhost:1 and 127.0.0.1:1".to_owned()));
    }

    #[test]
    fn a_page_is_the_servers_own_where_its_origin_is_the_host_of_the_request() {
        let request =
            |host: &str| Request::builder().uri("/x").header(header::HOST, host).body(()).expect("a request");
        let is_own = |address: &Address, host: &str, origin: &str| {
            let hosts = AllowedHosts::new(address, &[]);
            hosts.is_own_origin(&request(host), &origin.parse().expect("a header"))
        };
        let tcp = Address::default();
        for (host, origin) in [
            ("192.0.2.7:6277", "http://192.0.2.7:6277"),
            ("[2001:db8::7]:6277", "http://[2001:db8::7]:6277"),
            ("NODE7:6277", "http://node7:6277"),
            ("node7", "http://node7"),
            ("node7:80", "http://node7"),
            ("node7", "https://node7"),
            ("node7", "https://node7:443"),
        ] {
            assert!(is_own(&tcp, host, origin), "{host} {origin}");
            assert!(!is_own(&Address::Unix("nappe.sock".into()), host, origin), "{host} {origin}");
        }
        for (host, origin) in [
            ("192.0.2.7:6277", "http://192.0.2.7:8000"),
            ("192.0.2.7:6277", "http://192.0.2.7"),
            ("192.0.2.7:6277", "http://192.0.2.8:6277"),
            ("192.0.2.7:6277", "null"),
            ("192.0.2.7:6277", ""),
            ("192.0.2.7:6277", "192.0.2.7:6277"),
            ("192.0.2.7:6277", "ftp://192.0.2.7:6277"),
            ("node7", "http://node7:443"),
            ("", "http://node7"),
            ("node7", "http://node7.evil.example"),
        ] {
            assert!(!is_own(&tcp, host, origin), "{host} {origin}");
        }

        let both = Request::builder().uri("http://node7:1/x").header(header::HOST, "node7:2").body(());
        let (both, hosts) = (both.expect("a request"), AllowedHosts::new(&tcp, &[]));
        for port in [1, 2] {
            let origin: HeaderValue = format!("http://node7:{port}").parse().expect("a header");
            assert!(!hosts.is_own_origin(&both, &origin), "it names two places");
        }
    }

    #[test]
    fn every_host_is_that_of_a_unix_socket() {
        let hosts = AllowedHosts::new(&Address::Unix("nappe.sock".into()), &[]);
        for host in ["localhost", "run%2Fnappe.sock", "other.example", ""] {
            let request =
                Request::builder().uri("/x").header(header::HOST, host).body(()).expect("a request");
            assert_eq!(hosts.check(&request), Ok(()), "{host}");
        }
    }
}

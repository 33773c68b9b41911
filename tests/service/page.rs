//! The page for browsers, `GET /`: given to whoever may ask, without a token; and every other path is as it was.

use std::{fs, future::poll_fn, io::Read as _, path::Path};

use flate2::read::GzDecoder;
use nappe_server::{App, Config, Reason};
use tonic::{body::Body, client::GrpcService, codegen::http::Request};

use crate::{
    grpc_web::{Answer, exchange_at, exchange_bare},
    harness::{channel, config},
};

/// Most bytes of the page on its way.
const PACKED_BYTES: usize = 250_000;
const INFO: &str = "/nappe.v1.SimulationService/GetServerInfo";
const WEB: &str = "Content-Type: application/grpc-web+proto\r\n";

/// A server that asks for its token.
fn guarded(config: Config) -> App {
    let address = "127.0.0.1:0".parse().expect("an address");
    App::start(Config { address, ..config }).expect("the server starts")
}

async fn get(app: &App, path: &str, headers: &str) -> Answer {
    exchange_at(app.local_addr(), "GET", path, headers, b"").await
}

/// The page as it was built.
fn built() -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../viewer/web/dist/live.html");
    fs::read(path).expect("it is committed")
}

/// What the answer with the page says of it, whatever its form.
fn assert_headers(answer: &Answer) {
    for (name, value) in [
        ("content-type", "text/html; charset=utf-8"),
        ("x-content-type-options", "nosniff"),
        ("referrer-policy", "no-referrer"),
        ("cache-control", "no-cache"),
    ] {
        assert_eq!(answer.header(name), Some(value));
    }
    assert!(answer.lists("vary", "accept-encoding"));
    assert!(answer.header("set-cookie").is_none(), "all ports of a host share cookies");
    let policy = answer.header("content-security-policy").expect("a policy");
    let rules: Vec<_> = policy.split(';').map(str::trim).collect();
    for rule in ["default-src 'none'", "connect-src 'self'"] {
        assert!(rules.contains(&rule), "{policy}");
    }
    let script = rules.iter().find_map(|rule| rule.strip_prefix("script-src ")).expect("a rule for scripts");
    let hash = script.strip_prefix("'sha256-").and_then(|rest| rest.strip_suffix('\'')).expect("a hash");
    assert!(String::from_utf8(built()).expect("a text").contains(hash), "it is that of the page");
    let framers = rules.iter().find_map(|rule| rule.strip_prefix("frame-ancestors ")).expect("who frames it");
    assert_eq!(framers, "'self'", "another port may be of another user");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_page_is_given_without_a_token_plain_or_packed() {
    let app = guarded(config());
    let built = built();
    // Pages are asked for with a session, which the page reads itself.
    for path in
        ["/", "/?", "/?session=first", "/?session=%3Cscript%3E", "http://localhost/", "http://localhost"]
    {
        let page = get(&app, path, "").await;
        assert_eq!((page.status, page.header("content-encoding")), (200, None), "{path}");
        assert!(page.bytes() == built, "{path}");
        assert_headers(&page);
    }
    assert!(!String::from_utf8_lossy(&built).contains(app.token().expect("a token").reveal()));

    let packed = get(&app, "/", "Accept-Encoding: gzip, deflate, br, zstd\r\n").await;
    assert_eq!((packed.status, packed.header("content-encoding")), (200, Some("gzip")));
    assert_headers(&packed);
    let size = packed.bytes().len();
    println!("{size} bytes packed, {} plain", built.len());
    assert!(size <= PACKED_BYTES, "{size} bytes");
    let mut page = Vec::new();
    GzDecoder::new(packed.bytes()).read_to_end(&mut page).expect("gzip");
    assert!(page == built);
    let refusing = get(&app, "/", "Accept-Encoding: br, gzip;q=0\r\n").await;
    assert_eq!(refusing.header("content-encoding"), None);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_head_of_the_page_is_that_of_the_page() {
    let app = guarded(config());
    for coding in ["", "Accept-Encoding: gzip\r\n"] {
        let page = get(&app, "/", coding).await;
        let head = exchange_at(app.local_addr(), "HEAD", "/", coding, b"").await;
        assert_eq!((head.status, head.bytes().len()), (200, 0));
        assert_headers(&head);
        for name in ["content-length", "content-encoding", "etag"] {
            assert_eq!(head.header(name), page.header(name), "{name}");
        }
        assert_eq!(head.header("content-length"), Some(page.bytes().len().to_string().as_str()));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_browser_that_has_the_page_is_not_sent_it_again() {
    let app = guarded(config());
    let mut tags = Vec::new();
    for coding in ["", "Accept-Encoding: gzip\r\n"] {
        let tag = get(&app, "/", coding).await.header("etag").expect("a tag").to_owned();
        for known in [tag.clone(), format!("W/{tag}"), format!("\"other\", {tag}"), "*".to_owned()] {
            let headers = format!("{coding}If-None-Match: {known}\r\n");
            let same = get(&app, "/", &headers).await;
            assert_eq!((same.status, same.bytes().len()), (304, 0), "{known}");
            assert_eq!(same.header("etag"), Some(tag.as_str()));
            assert!(same.header("content-security-policy").is_some());
        }
        let other = get(&app, "/", &format!("{coding}If-None-Match: \"other\"\r\n")).await;
        assert_eq!(other.status, 200);
        tags.push(tag);
    }
    assert_ne!(tags[0], tags[1], "each form has its own");
    let again = guarded(config());
    let tag = get(&again, "/", "").await.header("etag").map(str::to_owned);
    assert_eq!(tag.as_deref(), Some(tags[0].as_str()), "another server has the same page");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_page_comes_over_http_2_too() {
    let app = guarded(config());
    let mut channel = channel(&app).await;
    poll_fn(|context| GrpcService::<Body>::poll_ready(&mut channel, context)).await.expect("connected");
    let request = Request::get("/").body(Body::empty()).expect("a request");
    let answer = GrpcService::call(&mut channel, request).await.expect("an answer");
    assert_eq!(answer.status().as_u16(), 200);
    let length = answer.headers().get("content-length").expect("a length");
    assert_eq!(length, &built().len().to_string());
}

#[tokio::test(flavor = "multi_thread")]
async fn every_other_path_and_method_is_no_page() {
    let app = guarded(config());
    for (method, path, status) in [
        ("GET", "//", 405),
        ("GET", "/../", 405),
        ("GET", "/./", 405),
        ("GET", "/%2e", 405),
        ("GET", "/index.html", 405),
        ("GET", "/live.html", 405),
        ("GET", "/favicon.ico", 405),
        ("GET", INFO, 405),
        ("HEAD", "/index.html", 405),
        ("PUT", "/", 405),
        ("DELETE", "/", 405),
        ("TRACE", "/", 405),
        ("POST", "/", 415),
    ] {
        let answer = exchange_at(app.local_addr(), method, path, "", b"").await;
        assert_eq!((answer.status, answer.bytes().len()), (status, 0), "{method} {path}");
        assert_eq!(answer.reason(), Reason::NotACall.name(), "{method} {path}");
        assert_eq!(answer.header("content-security-policy"), None);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rebound_host_a_foreign_page_and_headers_without_end_get_no_page() {
    let app = guarded(config());
    let long = format!("Host: localhost\r\nX-Long: {}\r\n", "x".repeat(100_000));
    for (path, headers, status, reason) in [
        ("/", "Host: evil.example\r\n", 403, Reason::HostNotAllowed),
        ("/", "Host: evil@127.0.0.1\r\n", 403, Reason::HostNotAllowed),
        ("/", "", 403, Reason::HostNotAllowed),
        ("/", "Host: localhost\r\nHost: evil.example\r\n", 403, Reason::HostNotAllowed),
        ("http://evil.example/", "Host: localhost\r\n", 403, Reason::HostNotAllowed),
        ("/", "Host: localhost\r\nOrigin: https://evil.example\r\n", 403, Reason::OriginNotAllowed),
        ("/", "Host: localhost\r\nOrigin: null\r\n", 403, Reason::OriginNotAllowed),
        ("/", long.as_str(), 431, Reason::HeadersTooLarge),
    ] {
        let refused = exchange_bare(app.local_addr(), "GET", path, headers, b"").await;
        assert_eq!(refused.status, status, "{headers:.80}");
        assert!(refused.text().starts_with(reason.name()), "{headers:.80}: {}", refused.text());
        assert_eq!(refused.header("content-type"), Some("text/plain; charset=utf-8"));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_from_where_its_calls_go_may_call_and_no_other() {
    let app = guarded(config());
    let shown = format!("{WEB}Authorization: Bearer {}\r\n", app.token().expect("a token").reveal());
    let call = async |host: &str, origin: &str| {
        let headers = format!("Host: {host}\r\nOrigin: {origin}\r\n{shown}");
        exchange_bare(app.local_addr(), "POST", INFO, &headers, &[0; 5]).await
    };
    for (host, origin) in [
        ("192.0.2.7:6277", "http://192.0.2.7:6277"),
        ("[2001:db8::7]:6277", "http://[2001:db8::7]:6277"),
        ("nappe.localhost", "https://nappe.localhost"),
    ] {
        let answer = call(host, origin).await;
        assert_eq!((answer.status, answer.header("grpc-status")), (200, None), "{host} {origin}");
    }
    for (host, origin, reason) in [
        ("192.0.2.7:6277", "http://192.0.2.7:8000", Reason::OriginNotAllowed),
        ("192.0.2.7:6277", "http://192.0.2.8:6277", Reason::OriginNotAllowed),
        ("localhost", "http://evil.example", Reason::OriginNotAllowed),
        // A name that was made to mean this machine is refused, whatever page it is of.
        ("evil.example", "http://evil.example", Reason::HostNotAllowed),
    ] {
        assert_eq!(call(host, origin).await.reason(), reason.name(), "{host} {origin}");
    }
    let stranger = format!("Host: 192.0.2.7:6277\r\nOrigin: http://192.0.2.7:6277\r\n{WEB}");
    let refused = exchange_bare(app.local_addr(), "POST", INFO, &stranger, &[0; 5]).await;
    assert_eq!(refused.reason(), Reason::TokenMissing.name(), "its own page needs the token too");
}

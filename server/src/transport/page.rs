//! `GET /`: the page for browsers. It holds nothing of a session, and asks for no token.
//!
//! Enters: a request. Leaves: the page, packed where the browser takes that, or that the browser has it already, or why the
//! request may not come in. The page's own policy says which script may run; in a header it also says who may frame it.

use std::{
    io::{self, Write as _},
    sync::LazyLock,
};

use bytes::Bytes;
use flate2::{Compression, write::GzEncoder};
use http::{HeaderMap, HeaderName, HeaderValue, Method, Request, Response, StatusCode, header};
use http_body_util::Full;
use tonic::body::Body;
use xxhash_rust::xxh3::xxh3_64;

use super::{door::Door, interceptor::too_large};
use crate::{
    error::{Reason, ServiceError},
    refusals::Call,
};

/// The page, which CI builds again and compares.
const PAGE: &str = include_str!("../../../viewer/web/dist/live.html");
/// What stands before the policy in the page, and behind it.
const POLICY: [&str; 2] = [r#"http-equiv="Content-Security-Policy" content=""#, r#"""#];
/// Whose pages may frame this one: its own. Another port of this machine may be of another user, whose page could have
/// clicks meant for something else land here.
const ANCESTORS: &str = "frame-ancestors 'self'";

/// One form of the page.
struct Form {
    bytes: Bytes,
    tag: HeaderValue,
}

/// What is made of the page once, when somebody asks for it.
struct Served {
    plain: Form,
    packed: Form,
    policy: HeaderValue,
}

static SERVED: LazyLock<Served> = LazyLock::new(|| {
    let hash = xxh3_64(PAGE.as_bytes());
    let tag = |form: &str| format!("\"{hash:016x}{form}\"").parse().expect("hexadecimal digits");
    let packed = gzip(PAGE.as_bytes()).expect("memory takes what is written");
    let policy = format!("{}; {ANCESTORS}", policy(PAGE).expect("the page has a policy"));
    Served {
        plain: Form { bytes: Bytes::from_static(PAGE.as_bytes()), tag: tag("") },
        packed: Form { bytes: packed.into(), tag: tag("-gzip") },
        policy: policy.parse().expect("a policy is printable"),
    }
});

/// The answer to a request for the page; none if it asks for something else.
pub(super) fn answer<B>(request: &Request<B>, door: &Door) -> Option<Response<Body>> {
    let is_head = request.method() == Method::HEAD;
    if !(is_head || request.method() == Method::GET) || request.uri().path() != "/" {
        return None;
    }
    let headers = request.headers();
    if let Some(refusal) = door.refusal_without_token(request).or_else(|| too_large(headers)) {
        Call::of(request.extensions()).refused(refusal.reason);
        return Some(refused(&refusal, request.method()));
    }

    let is_packed = takes_gzip(headers);
    let form = if is_packed { &SERVED.packed } else { &SERVED.plain };
    let is_known = knows(headers, &form.tag);
    let body = if is_known || is_head { Body::empty() } else { Body::new(Full::new(form.bytes.clone())) };
    let mut response = Response::new(body);
    let fields = response.headers_mut();
    fields.insert(header::ETAG, form.tag.clone());
    fields.insert(header::CONTENT_SECURITY_POLICY, SERVED.policy.clone());
    for (name, value) in [
        // It is asked for again after each start: another version may have the port.
        (header::CACHE_CONTROL, "no-cache"),
        (header::VARY, "accept-encoding"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
    ] {
        set(fields, name, value);
    }
    if is_known {
        *response.status_mut() = StatusCode::NOT_MODIFIED;
        return Some(response);
    }
    set(fields, header::CONTENT_TYPE, "text/html; charset=utf-8");
    if is_packed {
        set(fields, header::CONTENT_ENCODING, "gzip");
    }
    fields.insert(header::CONTENT_LENGTH, form.bytes.len().into());
    Some(response)
}

/// Why the page is not given, for the person who reads it.
fn refused(refusal: &ServiceError, method: &Method) -> Response<Body> {
    let is_large = refusal.reason == Reason::HeadersTooLarge;
    let text = format!("{}: {}\n", refusal.reason.name(), refusal.message);
    let mut response = Response::new(if method == Method::HEAD { Body::empty() } else { Body::new(text) });
    *response.status_mut() =
        if is_large { StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE } else { StatusCode::FORBIDDEN };
    set(response.headers_mut(), header::CONTENT_TYPE, "text/plain; charset=utf-8");
    set(response.headers_mut(), header::X_CONTENT_TYPE_OPTIONS, "nosniff");
    response
}

fn set(headers: &mut HeaderMap, name: HeaderName, value: &'static str) {
    headers.insert(name, HeaderValue::from_static(value));
}

/// The policy that stands in a page.
fn policy(page: &str) -> Option<&str> {
    let [before, behind] = POLICY;
    page.split_once(before)?.1.split_once(behind).map(|(policy, _)| policy)
}

fn gzip(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    packed.write_all(bytes)?;
    packed.finish()
}

/// The entries of a list that may stand in several headers.
fn entries(headers: &HeaderMap, name: HeaderName) -> impl Iterator<Item = &str> {
    let lists = headers.get_all(name).into_iter().filter_map(|list| list.to_str().ok());
    lists.flat_map(|list| list.split(',')).map(str::trim)
}

/// Whether the browser has this form of the page.
fn knows(headers: &HeaderMap, tag: &HeaderValue) -> bool {
    let is_it = |known: &str| known == "*" || known.trim_start_matches("W/").as_bytes() == tag.as_bytes();
    entries(headers, header::IF_NONE_MATCH).any(is_it)
}

/// Whether the browser takes what gzip has packed: it says so of gzip, or else of everything.
fn takes_gzip(headers: &HeaderMap) -> bool {
    let taken = |coding: &str| {
        entries(headers, header::ACCEPT_ENCODING).find_map(|entry| {
            let (name, weight) = entry.split_once(';').unwrap_or((entry, "q=1"));
            let weight = weight.trim().strip_prefix("q=").and_then(|weight| weight.parse::<f32>().ok());
            name.trim().eq_ignore_ascii_case(coding).then_some(weight.is_some_and(|weight| weight > 0.0))
        })
    };
    taken("gzip").or_else(|| taken("*")).unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_policy_is_that_of_the_page_and_says_who_may_frame_it() {
        assert_eq!(
            policy("<meta http-equiv=\"Content-Security-Policy\" content=\"a 'b'; c\">"),
            Some("a 'b'; c")
        );
        assert_eq!(policy("<meta name=\"x\" content=\"a\">"), None);
        let policy = SERVED.policy.to_str().expect("it is printable");
        let has = |rule: &str| policy.split(';').any(|own| own.trim() == rule);
        assert!(has("default-src 'none'") && has("connect-src 'self'") && has(ANCESTORS), "{policy}");
        assert!(policy.contains("script-src 'sha256-") && !policy.contains("script-src 'unsafe"), "{policy}");
    }

    #[test]
    fn a_browser_says_what_it_takes_and_what_it_has() {
        let with = |name: HeaderName, value: &str| {
            let mut headers = HeaderMap::new();
            headers.insert(name, value.parse().expect("a header"));
            headers
        };
        let takes = |value: &str| takes_gzip(&with(header::ACCEPT_ENCODING, value));
        for good in
            ["gzip", "gzip, deflate, br, zstd", "br;q=1.0, GZIP;q=0.5", "*", "br, *;q=0.1", "gzip; q=1"]
        {
            assert!(takes(good), "{good}");
        }
        for bad in ["", "br", "identity", "gzip;q=0", "gzip;q=0, *", "*;q=0", "gzipped", "gzip;q=x"] {
            assert!(!takes(bad), "{bad}");
        }
        assert!(!takes_gzip(&HeaderMap::new()));

        let tag = HeaderValue::from_static("\"00ff\"");
        let known = |value: &str| knows(&with(header::IF_NONE_MATCH, value), &tag);
        assert!(known("\"00ff\"") && known("W/\"00ff\"") && known("\"1\", \"00ff\"") && known("*"));
        assert!(!known("\"00ff-gzip\"") && !known("00ff") && !known("") && !knows(&HeaderMap::new(), &tag));
    }
}

//! `GET /metrics`: numbers of the server in the exposition format of Prometheus, version 0.0.4.
//!
//! Enters: a request, and what calls share. Leaves: the page, or why the request may not come in. A name ends in `_total`
//! if its number only grows, and has its unit before that.

use http::{Request, Response, StatusCode, header};
use nappe_proto::v1::{self, SessionState};
use tonic::{Code, body::Body};

use super::{door::Door, method::Method};
use crate::{refusals::Call, rpc::Shared};

/// Where the page is.
const PATH: &str = "/metrics";
/// What the page is.
const CONTENT: &str = "text/plain; version=0.0.4; charset=utf-8";
/// The version of the server, as a label.
const VERSION: &str = concat!("{version=\"", env!("CARGO_PKG_VERSION"), "\"}");
/// States of sessions, as labels.
const STATES: [(&str, SessionState); 4] = [
    ("{state=\"paused\"}", SessionState::Paused),
    ("{state=\"playing\"}", SessionState::Playing),
    ("{state=\"finished\"}", SessionState::Finished),
    ("{state=\"failed\"}", SessionState::Failed),
];

/// A family of numbers: name, help, and each number with its labels.
type Family = (&'static str, &'static str, Vec<(String, u64)>);

/// The answer to a request for the page; none if it asks for something else.
pub(super) fn answer<B>(request: &Request<B>, door: &Door, shared: &Shared) -> Option<Response<Body>> {
    if request.method() != http::Method::GET || request.uri().path() != PATH {
        return None;
    }
    let Err(refusal) = door.admit(request, &Method::new(PATH)) else {
        return Some(plain(StatusCode::OK, page(shared)));
    };
    Call::of(request.extensions()).refused(refusal.reason);
    let is_unknown = refusal.reason.code() == Code::Unauthenticated;
    let status = if is_unknown { StatusCode::UNAUTHORIZED } else { StatusCode::FORBIDDEN };
    let mut response = plain(status, format!("{}: {}\n", refusal.reason.name(), refusal.message));
    if is_unknown {
        response.headers_mut().insert(header::WWW_AUTHENTICATE, header::HeaderValue::from_static("Bearer"));
    }
    Some(response)
}

fn plain(status: StatusCode, text: String) -> Response<Body> {
    let mut response = Response::new(Body::new(text));
    *response.status_mut() = status;
    response.headers_mut().insert(header::CONTENT_TYPE, header::HeaderValue::from_static(CONTENT));
    response
}

/// The page. It holds no lock for longer than it takes to read a session's description, and none during a step.
fn page(shared: &Shared) -> String {
    families(shared).iter().map(text).collect()
}

fn families(shared: &Shared) -> [Family; 11] {
    let sessions = shared.registry.all();
    let pending: u64 = sessions.iter().map(|session| session.pending_count()).sum();
    let sessions: Vec<v1::Session> = sessions.iter().map(|session| session.describe()).collect();
    let in_state =
        |state: SessionState| sessions.iter().filter(|session| session.state() == state).count() as u64;
    let watchers: u64 = sessions.iter().map(|session| u64::from(session.watcher_count)).sum();
    let (counters, memory) = (&shared.counters, &shared.memory);
    let one = |number: u64| vec![(String::new(), number)];
    let refused = shared.refusals.counts().into_iter();
    let refused = refused.map(|(reason, count)| (format!("{{reason=\"{}\"}}", reason.name()), count));
    [
        ("nappe_build_info", "The version of the server; the number is 1.", vec![(VERSION.to_owned(), 1)]),
        (
            "nappe_sessions",
            "Sessions by state.",
            STATES.map(|(label, state)| (label.to_owned(), in_state(state))).to_vec(),
        ),
        ("nappe_steps_total", "Steps that all sessions took.", one(counters.steps.get())),
        ("nappe_session_failures_total", "Sessions that failed.", one(counters.failures.get())),
        ("nappe_watchers", "Streams of frames or diagnostics that are open.", one(watchers)),
        ("nappe_pending_changes", "Changes of parameters that wait for their step.", one(pending)),
        ("nappe_sent_bytes_total", "Bytes written to connections.", one(counters.sent_bytes.get())),
        (
            "nappe_held_frames_bytes",
            "Memory of frames that watchers alone hold.",
            one(shared.streams.memory().held()),
        ),
        (
            "nappe_reserved_memory_bytes",
            "Memory reserved for sessions, meshes and requests.",
            one(memory.used()),
        ),
        ("nappe_reservable_memory_bytes", "Memory that may be reserved.", one(memory.limit())),
        (
            "nappe_refused_requests_total",
            "Calls and connections refused and watchers cut, by reason.",
            refused.collect(),
        ),
    ]
}

fn text((name, help, numbers): &Family) -> String {
    let kind = if name.ends_with("_total") { "counter" } else { "gauge" };
    let lines = numbers.iter().map(|(labels, number)| format!("{name}{labels} {number}\n"));
    format!("# HELP {name} {help}\n# TYPE {name} {kind}\n{}", lines.collect::<Vec<_>>().concat())
}

//! What who runs a server reads of it: `GET /metrics`, in the format of Prometheus, behind the token.

use std::{collections::BTreeMap, net::SocketAddr};

use nappe_proto::v1::{self, SessionState};
use nappe_server::{App, Config, Reason};

use crate::{
    cloth_scenes::sheet,
    failed_sessions::diverging,
    frames::in_time,
    grpc_web::{Answer, exchange_at},
    harness::{Server, config, latest},
};

/// A page of metrics, checked: each number by its name with labels.
struct Page(BTreeMap<String, u64>);

impl Page {
    async fn of(server: &Server) -> Self {
        let answer = get(server.app.local_addr(), "").await;
        assert_eq!(answer.status, 200);
        assert_eq!(answer.header("content-type"), Some("text/plain; version=0.0.4; charset=utf-8"));
        Self::read(answer.text())
    }

    /// Reads a page as the format asks: each family in one piece, its help and its type before its numbers.
    fn read(text: &str) -> Self {
        assert!(text.ends_with('\n'), "{text}");
        let mut kinds = BTreeMap::new();
        let mut numbers = BTreeMap::new();
        let (mut helped, mut typed) = ("", "");
        for line in text.lines() {
            if let Some(help) = line.strip_prefix("# HELP ") {
                helped = help.split_once(' ').filter(|(_, words)| !words.is_empty()).expect("words").0;
                assert!(is_name(helped), "{line}");
            } else if let Some(kind) = line.strip_prefix("# TYPE ") {
                let (name, kind) = kind.split_once(' ').expect("a type");
                assert_eq!(name, helped, "help comes first");
                assert_eq!(kind, if name.ends_with("_total") { "counter" } else { "gauge" }, "{line}");
                assert!(kinds.insert(name, kind).is_none(), "a family stands in one piece: {line}");
                typed = name;
            } else {
                let (name, number) = line.rsplit_once(' ').expect("a number");
                assert_eq!(name.split('{').next(), Some(typed), "{line}");
                let labels = &name[typed.len()..];
                assert!(labels.is_empty() || (labels.starts_with('{') && labels.ends_with("\"}")), "{line}");
                let number = number.parse().expect("a whole number");
                assert!(numbers.insert(name.to_owned(), number).is_none(), "once: {line}");
            }
        }
        let has_numbers = |family: &str| numbers.keys().any(|name| name.split('{').next() == Some(family));
        assert!(kinds.len() > 5 && kinds.into_keys().all(has_numbers), "{text}");
        Self(numbers)
    }

    fn number(&self, name: &str) -> u64 {
        *self.0.get(name).unwrap_or_else(|| panic!("no {name} in {:?}", self.0))
    }

    fn in_state(&self, state: &str) -> u64 {
        self.number(&format!("nappe_sessions{{state=\"{state}\"}}"))
    }
}

/// Whether it is a name of a metric of this program, in the alphabet of Prometheus.
fn is_name(name: &str) -> bool {
    let is_allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    name.strip_prefix("nappe_").is_some_and(|rest| !rest.is_empty() && rest.chars().all(is_allowed))
}

async fn get(server: SocketAddr, headers: &str) -> Answer {
    exchange_at(server, "GET", "/metrics", headers, b"").await
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_tell_sessions_steps_watchers_memory_and_what_waits() {
    let mut server = Server::start().await;
    let empty = Page::of(&server).await;
    let names =
        ["nappe_steps_total", "nappe_watchers", "nappe_pending_changes", "nappe_reserved_memory_bytes"];
    assert_eq!(names.map(|name| empty.number(name)), [0; 4]);
    assert_eq!(empty.number(&format!("nappe_build_info{{version=\"{}\"}}", env!("CARGO_PKG_VERSION"))), 1);

    let (first, second) = (server.session(sheet(5)).await, server.session(sheet(5)).await);
    server.step(&first, 7).await;
    server.step(&second, 4).await;
    let watch = server.watch(latest(&first)).await;
    let gravity = server.get(&second).await.parameters.expect("parameters").gravity;
    let later =
        v1::UpdateParametersRequest { gravity, at_step: 900, ..v1::UpdateParametersRequest::of(&second) };
    server.client.update_parameters(later).await.expect("accepted");

    let page = Page::of(&server).await;
    assert_eq!(["paused", "playing", "finished", "failed"].map(|state| page.in_state(state)), [2, 0, 0, 0]);
    assert_eq!(names[..3].iter().map(|name| page.number(name)).collect::<Vec<_>>(), [11, 1, 1]);
    let (reserved, most) =
        (page.number("nappe_reserved_memory_bytes"), page.number("nappe_reservable_memory_bytes"));
    assert!(0 < reserved && reserved <= most, "{reserved} of {most}");
    assert!(page.number("nappe_sent_bytes_total") > empty.number("nappe_sent_bytes_total"));

    // What was done stays counted when its session is gone.
    drop(watch);
    server.client.delete_session(v1::DeleteSessionRequest::of(&first)).await.expect("deleted");
    let page = Page::of(&server).await;
    assert_eq!((page.in_state("paused"), page.number("nappe_steps_total")), (1, 11));
    assert_eq!((page.number("nappe_watchers"), page.number("nappe_pending_changes")), (0, 1));
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_are_told_while_a_session_plays_and_count_those_that_fail() {
    let mut server = Server::start().await;
    let playing = server.session(sheet(3)).await;
    server.play_in_real_time(&playing).await;
    let counted = async {
        let mut last = 0;
        while last < 20 {
            let page = Page::of(&server).await;
            assert_eq!(page.in_state("playing"), 1);
            let steps = page.number("nappe_steps_total");
            assert!(steps >= last, "it only grows: {steps} after {last}");
            last = steps;
        }
    };
    in_time(counted).await;

    let bad = server.session(diverging()).await;
    server.play(&bad).await;
    server.until(&bad, |session| session.state() == SessionState::Failed).await;
    let page = Page::of(&server).await;
    assert_eq!((page.in_state("failed"), page.number("nappe_session_failures_total")), (1, 1));
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_are_for_those_who_show_the_token_and_for_nobody_else() {
    let address = "127.0.0.1:0".parse().expect("an address");
    let app = App::start(Config { address, ..config() }).expect("the server starts");
    let server = app.local_addr();
    let token = app.token().expect("a token is the default").reveal();
    for (shown, reason) in
        [("", "TOKEN_MISSING"), ("Authorization: Bearer 0123456789abcdef\r\n", "TOKEN_WRONG")]
    {
        let refused = get(server, shown).await;
        assert_eq!((refused.status, refused.header("www-authenticate")), (401, Some("Bearer")));
        assert!(
            refused.text().starts_with(reason) && !refused.text().contains("nappe_"),
            "{}",
            refused.text()
        );
    }

    let shown = format!("Authorization: Bearer {token}\r\n");
    let page = get(server, &shown).await;
    assert_eq!(page.status, 200);
    let page = Page::read(page.text());
    let refused = |reason: Reason| {
        page.number(&format!("nappe_refused_requests_total{{reason=\"{}\"}}", reason.name()))
    };
    assert_eq!([Reason::TokenMissing, Reason::TokenWrong].map(refused), [1, 1]);
    assert_eq!(Reason::ALL.iter().map(|reason| refused(*reason)).sum::<u64>(), 2);
    let stranger = get(server, &format!("{shown}Origin: https://other.example\r\n")).await;
    assert_eq!(stranger.status, 403);
    assert!(stranger.text().starts_with("ORIGIN_NOT_ALLOWED"), "{}", stranger.text());
    // The page is read, not called.
    let posted = exchange_at(server, "POST", "/metrics", &shown, b"").await;
    assert_eq!(posted.status, 415);
}

//! Links to one session: each who opens one may watch that session and work with copies of his own, and there is no other for him.

use std::time::Duration;

use nappe_proto::v1;
use nappe_server::{App, Config, Limits, Reason};
use tonic::{Request, Status};
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::sheet,
    frames::in_time,
    harness::{assert_reason, config, connect, request, started},
};

/// A server with the token that it draws by default, on a free port of loopback.
fn guarded(limits: Limits) -> App {
    let address = "127.0.0.1:0".parse().expect("an address");
    App::start(Config { address, limits, ..config() }).expect("the server starts")
}

fn token(app: &App) -> String {
    app.token().expect("a token is the default").reveal().to_owned()
}

/// A request that shows a token, if there is one.
fn showing<M>(message: M, token: Option<&str>) -> Request<M> {
    let mut request = Request::new(message);
    if let Some(token) = token {
        request.metadata_mut().insert("authorization", format!("Bearer {token}").parse().expect("a header"));
    }
    request
}

async fn create(app: &App, id: &str) -> v1::Session {
    let scene = Some(v1::create_session_request::Scene::SceneText(sheet(4)));
    let asked = v1::CreateSessionRequest { scene, session_id: id.to_owned(), ..request() };
    let made = connect(app).await.create_session(showing(asked, Some(&token(app)))).await;
    made.expect("a session").into_inner().session.expect("a session")
}

async fn make(app: &App, asked: v1::MakeLinkRequest) -> Result<v1::MakeLinkResponse, Status> {
    let made = connect(app).await.make_link(showing(asked, Some(&token(app)))).await;
    made.map(tonic::Response::into_inner)
}

/// A link to the session `class`.
async fn code(app: &App, forks: u32, uses: u32, seconds: u32) -> String {
    let asked = v1::MakeLinkRequest { session_id: "class".to_owned(), forks, uses, seconds };
    make(app, asked).await.expect("a link").code
}

async fn open(app: &App, code: &str) -> Result<String, Status> {
    let request = v1::OpenLinkRequest { code: code.to_owned() };
    connect(app).await.open_link(request).await.map(|answer| answer.into_inner().token)
}

/// A token of a link that has ended by its time.
async fn ended(app: &App) -> String {
    // On a busy machine a second may be over before the link is opened.
    let token = loop {
        let code = code(app, 1, 1, 1).await;
        if let Ok(token) = open(app, &code).await {
            break token;
        }
    };
    in_time(async {
        while outcome(app, Some(&token), "GetServerInfo", "class").await == "ok" {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    })
    .await;
    token
}

async fn fork(app: &App, token: &str, id: &str) -> Result<String, Status> {
    let asked = showing(v1::ForkSessionRequest::of(id), Some(token));
    let forked = connect(app).await.fork_session(asked).await?.into_inner();
    Ok(forked.session.expect("a session").session_id)
}

/// The outcome of a call about a session: `ok`, or a reason.
async fn outcome(app: &App, token: Option<&str>, method: &str, id: &str) -> String {
    let mut client = connect(app).await;
    macro_rules! ask {
        ($call:ident, $message:expr) => {
            client.$call(showing($message, token)).await.map(|_| ())
        };
    }
    let step = v1::StepSessionRequest { wait: true, ..v1::StepSessionRequest::of(id) };
    let update = v1::UpdateParametersRequest { drag: Some(0.1), ..v1::UpdateParametersRequest::of(id) };
    let answer = match method {
        "GetServerInfo" => ask!(get_server_info, v1::GetServerInfoRequest {}),
        "UploadMesh" => ask!(upload_mesh, tokio_stream::iter([v1::UploadMeshRequest::default()])),
        "BeginUpload" => ask!(begin_upload, v1::BeginUploadRequest::default()),
        "AppendUpload" => ask!(append_upload, v1::AppendUploadRequest::default()),
        "FinishUpload" => ask!(finish_upload, v1::FinishUploadRequest::default()),
        "CreateSession" => ask!(create_session, v1::CreateSessionRequest::default()),
        "ForkSession" => ask!(fork_session, v1::ForkSessionRequest::of(id)),
        "SaveSession" => ask!(save_session, v1::SaveSessionRequest::of(id)),
        "GetSession" => ask!(get_session, v1::GetSessionRequest::of(id)),
        "ListSessions" => ask!(list_sessions, v1::ListSessionsRequest::default()),
        "DeleteSession" => ask!(delete_session, v1::DeleteSessionRequest::of(id)),
        "PlaySession" => ask!(play_session, v1::PlaySessionRequest::of(id)),
        "PauseSession" => ask!(pause_session, v1::PauseSessionRequest::of(id)),
        "StepSession" => ask!(step_session, step),
        "StopSession" => ask!(stop_session, v1::StopSessionRequest::of(id)),
        "UpdateParameters" => ask!(update_parameters, update),
        "ListPendingChanges" => ask!(list_pending_changes, v1::ListPendingChangesRequest::of(id)),
        "ResetSession" => ask!(reset_session, v1::ResetSessionRequest::of(id)),
        "DropPendingChanges" => ask!(drop_pending_changes, v1::DropPendingChangesRequest::of(id)),
        "WatchFrames" => ask!(watch_frames, v1::WatchFramesRequest::of(id)),
        "WatchDiagnostics" => ask!(watch_diagnostics, v1::WatchDiagnosticsRequest::of(id)),
        "MakeLink" => ask!(make_link, v1::MakeLinkRequest::default()),
        "OpenLink" => ask!(open_link, v1::OpenLinkRequest::default()),
        other => panic!("there is no method {other}"),
    };
    match answer {
        Ok(()) => "ok".to_owned(),
        Err(status) => status.get_details_error_info().expect("a reason").reason,
    }
}

const NARROW: &str = "LINK_TOO_NARROW";
const HIDDEN: &str = "SESSION_NOT_FOUND";

/// What a token of a link gets: about the session of the link, a copy of one's own, and another's session.
const TABLE: [(&str, [&str; 3]); 23] = [
    ("GetServerInfo", ["ok"; 3]),
    ("UploadMesh", [NARROW; 3]),
    ("BeginUpload", [NARROW; 3]),
    ("AppendUpload", [NARROW; 3]),
    ("FinishUpload", [NARROW; 3]),
    ("CreateSession", [NARROW; 3]),
    ("ForkSession", ["ok", "ok", HIDDEN]),
    ("SaveSession", [NARROW; 3]),
    ("GetSession", ["ok", "ok", HIDDEN]),
    ("ListSessions", ["ok"; 3]),
    ("DeleteSession", [NARROW, "ok", HIDDEN]),
    ("PlaySession", [NARROW, "ok", HIDDEN]),
    ("PauseSession", [NARROW, "ok", HIDDEN]),
    ("StepSession", [NARROW, "ok", HIDDEN]),
    ("StopSession", [NARROW, "ok", HIDDEN]),
    ("UpdateParameters", [NARROW, "ok", HIDDEN]),
    ("ListPendingChanges", ["ok", "ok", HIDDEN]),
    ("ResetSession", [NARROW, "ok", HIDDEN]),
    ("DropPendingChanges", [NARROW, "ok", HIDDEN]),
    ("WatchFrames", ["ok", "ok", HIDDEN]),
    ("WatchDiagnostics", ["ok", "ok", HIDDEN]),
    ("MakeLink", [NARROW; 3]),
    ("OpenLink", ["LINK_NOT_FOUND"; 3]),
];

/// Deletes every copy that the bearer of a token sees.
async fn delete_copies(app: &App, token: &str) {
    let listed =
        connect(app).await.list_sessions(showing(v1::ListSessionsRequest::default(), Some(token))).await;
    for session in listed.expect("listed").into_inner().sessions {
        if session.session_id != "class" {
            let gone = outcome(app, Some(token), "DeleteSession", &session.session_id).await;
            assert_eq!(gone, "ok");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_method_with_every_token_does_what_the_table_says() {
    let app = guarded(Limits::default());
    create(&app, "class").await;
    create(&app, "strange").await;
    let code = code(&app, 4, 2, 600).await;
    let (own, other) = (open(&app, &code).await.expect("once"), open(&app, &code).await.expect("twice"));
    assert_ne!(own, other);
    assert_reason(&open(&app, &code).await.expect_err("thrice"), Reason::LinkNotFound);
    let of_other = fork(&app, &other, "class").await.expect("a copy");
    let (ended, whole) = (ended(&app).await, token(&app));
    for (method, expected) in TABLE {
        let copy = fork(&app, &own, "class").await.expect("a copy");
        for (id, expected) in
            ["class", &copy, "strange", &of_other].iter().zip([0, 1, 2, 2].map(|at| expected[at]))
        {
            assert_eq!(outcome(&app, Some(&own), method, id).await, expected, "{method} of {id}");
        }
        delete_copies(&app, &own).await;

        let missing = if method == "OpenLink" { "LINK_NOT_FOUND" } else { "TOKEN_MISSING" };
        assert_eq!(outcome(&app, None, method, "class").await, missing, "{method}");
        let wrong = if method == "OpenLink" { "LINK_NOT_FOUND" } else { "TOKEN_WRONG" };
        // A part of a token, a code that is used up, and the token of a link that has ended.
        for bad in [&own[1..], &code, &ended] {
            assert_eq!(outcome(&app, Some(bad), method, "class").await, wrong, "{method}");
        }

        // Whoever has the token of the server is refused nothing because of who he is.
        let copy = fork(&app, &whole, "class").await.expect("a copy");
        let got = outcome(&app, Some(&whole), method, &copy).await;
        let for_others = [NARROW, HIDDEN, "TOKEN_MISSING", "TOKEN_WRONG"];
        assert!(!for_others.contains(&got.as_str()), "{method}: {got}");
        if method != "DeleteSession" {
            assert_eq!(outcome(&app, Some(&whole), "DeleteSession", &copy).await, "ok");
        }
    }
    // What does not exist for one is said to be missing word for word as what does not exist.
    let get = async |id: &str| {
        let asked = showing(v1::GetSessionRequest::of(id), Some(&own));
        connect(&app).await.get_session(asked).await.expect_err("hidden").message().to_owned()
    };
    assert_eq!(get("strange").await.replace("strange", "nothing"), get("nothing").await);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bearer_has_so_many_copies_chooses_no_ids_and_sees_its_own_alone() {
    let app = guarded(Limits::default());
    create(&app, "class").await;
    create(&app, "a-strange").await;
    let code = code(&app, 2, 2, 600).await;
    let own = open(&app, &code).await.expect("it is good");
    let first = fork(&app, &own, "class").await.expect("a copy");
    let second = fork(&app, &own, &first).await.expect("a copy of the copy");
    assert_reason(&fork(&app, &own, "class").await.expect_err("a third"), Reason::LinkTooNarrow);
    assert_eq!(outcome(&app, Some(&own), "DeleteSession", &first).await, "ok");
    fork(&app, &own, &second).await.expect("its place is free");
    delete_copies(&app, &own).await;

    let named =
        v1::ForkSessionRequest { new_session_id: "mine".into(), ..v1::ForkSessionRequest::of("class") };
    let refused = connect(&app).await.fork_session(showing(named, Some(&own))).await.expect_err("a name");
    assert_reason(&refused, Reason::LinkTooNarrow);
    let copy = fork(&app, &own, "class").await.expect("a copy");

    let mut seen = Vec::new();
    let mut page_token = String::new();
    loop {
        let asked = v1::ListSessionsRequest { page_size: 1, page_token };
        let listed = connect(&app).await.list_sessions(showing(asked, Some(&own))).await;
        let listed = listed.expect("a page").into_inner();
        seen.extend(listed.sessions.into_iter().map(|session| session.session_id));
        page_token = listed.next_page_token;
        if page_token.is_empty() {
            break;
        }
    }
    let mut expected = ["class".to_owned(), copy.clone()];
    expected.sort_unstable();
    assert_eq!(seen, expected);

    // Nothing waits for a bearer but a copy of its own, and there is no mesh for it.
    let paced = |id: &str| v1::WatchFramesRequest {
        delivery: v1::Delivery::Every.into(),
        pace_to_watcher: true,
        ..v1::WatchFramesRequest::of(id)
    };
    let refused = connect(&app).await.watch_frames(showing(paced("class"), Some(&own))).await;
    assert_reason(&refused.expect_err("it paces"), Reason::LinkTooNarrow);
    connect(&app).await.watch_frames(showing(paced(&copy), Some(&own))).await.expect("its own");
    let state =
        v1::StateUpdate { body: "sheet".into(), upload_id: "mesh-1".into(), ..v1::StateUpdate::default() };
    let put = v1::UpdateParametersRequest { states: vec![state], ..v1::UpdateParametersRequest::of(&copy) };
    let refused = connect(&app).await.update_parameters(showing(put, Some(&own))).await.expect_err("no mesh");
    assert_reason(&refused, Reason::MeshNotFound);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_link_ends_with_its_session_or_its_time_and_its_streams_with_it() {
    let app = guarded(Limits::default());
    for ends_by_time in [false, true] {
        create(&app, "class").await;
        let code = code(&app, 1, 9, if ends_by_time { 1 } else { 600 }).await;
        // On a busy machine a second may be over before the stream begins.
        let Ok(own) = open(&app, &code).await else {
            assert!(ends_by_time, "ten minutes are not over");
            continue;
        };
        let watch =
            connect(&app).await.watch_frames(showing(v1::WatchFramesRequest::of("class"), Some(&own))).await;
        match watch {
            Ok(watch) => {
                let mut stream = watch.into_inner();
                if !ends_by_time {
                    let whole = Some(token(&app));
                    assert_eq!(outcome(&app, whole.as_deref(), "DeleteSession", "class").await, "ok");
                }
                // The stream of a deleted session may end by itself first.
                let end = in_time(async {
                    loop {
                        match stream.message().await {
                            Ok(Some(_)) => {}
                            end => break end,
                        }
                    }
                })
                .await;
                if let Err(status) = &end {
                    let reason = status.get_details_error_info().expect("a reason").reason;
                    assert!(["TOKEN_WRONG", "SESSION_DELETED"].contains(&reason.as_str()), "{reason}");
                }
                assert!(!ends_by_time || end.is_err(), "the session goes on");
            }
            Err(status) => {
                assert!(ends_by_time, "{status}");
                assert_reason(&status, Reason::TokenWrong);
            }
        }
        assert_eq!(outcome(&app, Some(&own), "GetSession", "class").await, "TOKEN_WRONG");
        assert_reason(&open(&app, &code).await.expect_err("it has ended"), Reason::LinkNotFound);
        if ends_by_time {
            let whole = Some(token(&app));
            assert_eq!(outcome(&app, whole.as_deref(), "DeleteSession", "class").await, "ok");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_link_that_cannot_be_is_refused_by_its_field() {
    let app = guarded(Limits::default());
    create(&app, "class").await;
    let to = |session_id: &str, forks: u32, uses: u32, seconds: u32| v1::MakeLinkRequest {
        session_id: session_id.to_owned(),
        forks,
        uses,
        seconds,
    };
    for (asked, reason, told) in [
        (to("", 1, 0, 0), Reason::InvalidField, "session_id"),
        (to("", 0, 5, 0), Reason::InvalidField, "session_id"),
        (to("class", 5, 0, 0), Reason::InvalidField, "forks: is 5: allowed are at most 4"),
        (to("class", 0, 1001, 0), Reason::InvalidField, "uses: is 1001: allowed are at most 1000"),
        (to("class", 0, 0, 43_201), Reason::InvalidField, "seconds: is 43201: allowed are at most 43200"),
        (to("class", u32::MAX, u32::MAX, u32::MAX), Reason::InvalidField, "forks"),
        (to("nothing", 1, 1, 1), Reason::SessionNotFound, "nothing"),
    ] {
        let refused = make(&app, asked).await.expect_err("refused");
        assert_reason(&refused, reason);
        let said = refused.message();
        assert!(told.split(": ").all(|part| said.contains(part)), "{said}, not {told}");
    }
    let made = make(&app, to("class", 4, 1000, 43_200)).await.expect("the most");
    assert_eq!(Duration::from_secs_f64(made.expires_in_seconds), Duration::from_hours(12));
    let made = make(&app, to("class", 0, 0, 0)).await.expect("the least");
    assert_eq!(made.expires_in_seconds, 600.0);
    let own = open(&app, &made.code).await.expect("once");
    assert_reason(&fork(&app, &own, "class").await.expect_err("no copies"), Reason::LinkTooNarrow);
    assert_reason(&open(&app, &made.code).await.expect_err("twice"), Reason::LinkNotFound);

    // Where no token is asked for, nothing is narrow.
    let unguarded = started(config());
    let asked = to("class", 0, 0, 0);
    let refused = connect(&unguarded).await.make_link(asked).await.expect_err("no token");
    assert_reason(&refused, Reason::InvalidField);
}

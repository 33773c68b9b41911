//! docs/refusals.md: every method, what can be wrong with a call, and what the server answers. Methods and enums are
//! those of the descriptors, so that a new one is in the table or fails this test.

use std::{fmt::Write as _, fs, path::Path, time::Duration};

use nappe_proto::v1::{self, create_session_request::Scene, upload_mesh_request::Part};
use nappe_server::{App, Config, Limits};
use prost::Message as _;
use tonic::transport::Channel;

use crate::{
    cloth_scenes::{dust, sheet},
    frames::in_time,
    harness::{Client, Server, channel, config, every, request},
    proxy::Proxy,
    raw_calls::{Contract, outcome},
};

const SERVICE: &str = "/nappe.v1.SimulationService/";
/// Largest message of the servers here (bytes), and one byte more.
const MESSAGE_BYTES: usize = 64 << 10;

#[tokio::test(flavor = "multi_thread")]
async fn the_page_of_refusals_is_what_the_server_answers() {
    let contract = Contract::read();
    let mut page = String::from(
        "# Refusals\n\n\
         What a server answers to every method, by what is wrong with the call. A test calls each and compares; methods and enums\n\
         are those of the contract's descriptors. [The table of reasons](errors.md) says what each means and what to do.\n\n\
         The checks stand in the order of the first table: without the token nothing else is looked at. Below are a token of another\n\
         server, bytes that are no message, a message of one byte more than `--max-message-bytes`, and a call that arrives on an open connection\n\
         while the server drains.\n",
    );
    for_every_method(&contract, &mut page).await;
    unknown_enums(&contract, &mut page).await;
    limits(&mut page).await;

    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/refusals.md");
    if std::env::var_os("NAPPE_BLESS").is_some() {
        fs::write(&path, &page).expect("the page can be written");
    }
    let written = fs::read_to_string(&path).unwrap_or_default();
    for (line, (is, should)) in written.lines().zip(page.lines()).enumerate() {
        assert_eq!(is, should, "line {} of docs/refusals.md", line + 1);
    }
    assert!(
        written == page,
        "docs/refusals.md is out of date: run `cargo xtask bless pages` and look at the change"
    );
}

async fn for_every_method(contract: &Contract, page: &mut String) {
    let address = "127.0.0.1:0".parse().expect("an address");
    let guarded = App::start(Config { address, ..config() }).expect("the server starts");
    let limits = Limits { max_message_bytes: MESSAGE_BYTES as u64, ..Limits::default() };
    let open = Server::with(limits).await;
    let (stranger, caller) = (channel(&guarded).await, channel(&open.app).await);
    let late = while_draining(contract).await;

    page.push_str("\n## Every method\n\n");
    page.push_str("| method | no token | wrong token | malformed | too large | draining |\n");
    page.push_str("|---|---|---|---|---|---|\n");
    let wrong = Some("Bearer 0123456789abcdef0123456789abcdef");
    for (method, late) in contract.methods().into_iter().zip(late) {
        let path = &method.path;
        let cells = [
            outcome(&stranger, path, Vec::new(), None).await,
            outcome(&stranger, path, Vec::new(), wrong).await,
            outcome(&caller, path, vec![0xff; 7], None).await,
            outcome(&caller, path, vec![0; MESSAGE_BYTES + 1], None).await,
            late,
        ];
        let path = path.trim_start_matches('/');
        writeln!(page, "| `{path}` | {} |", cells.join(" | ")).expect("a string");
    }
}

/// What a server that drains answers to each method, over a line that keeps the server's farewell to itself: calls made
/// on it arrive while the server drains, as those of a client do that has not read its farewell yet.
async fn while_draining(contract: &Contract) -> Vec<String> {
    let mut server = Server::start().await;
    let line = Proxy::without_farewells(server.app.local_addr()).await;
    let channel = Channel::from_shared(line.url()).expect("a URL").connect().await.expect("connected");
    let info = format!("{SERVICE}GetServerInfo");
    assert_eq!(outcome(&channel, &info, Vec::new(), None).await, "OK");

    // A stream of more than is fetched of it, so that the connection is never idle, however late the calls come.
    let id = server.session(dust(300, "")).await;
    let stalled = Client::new(channel.clone()).watch_frames(every(&id, 0)).await.expect("the stream opens");
    tokio::spawn(server.app.shutdown());
    let draining = async {
        while outcome(&channel, &info, Vec::new(), None).await == "OK" {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    in_time(draining).await;

    let mut answers = Vec::new();
    for method in contract.methods() {
        answers.push(outcome(&channel, &method.path, Vec::new(), None).await);
    }
    drop(stalled);
    answers
}

async fn unknown_enums(contract: &Contract, page: &mut String) {
    page.push_str("\n## Values of enums that are not known\n\n| method | field | answer |\n|---|---|---|\n");
    let mut server = Server::start().await;
    let caller = channel(&server.app).await;
    for method in contract.methods() {
        for (field, unknown) in contract.unknown_enums(&method) {
            let id = server.session(sheet(3)).await;
            let base = match method.path.strip_prefix(SERVICE) {
                Some("CreateSession") => scene().encode_to_vec(),
                _ => contract.naming(&method, &id),
            };
            let answer = outcome(&caller, &method.path, [base, unknown].concat(), None).await;
            let path = method.path.trim_start_matches('/');
            writeln!(page, "| `{path}` | `{field}` | {answer} |").expect("a string");
            let delete = v1::DeleteSessionRequest::of(&id).encode_to_vec();
            assert_eq!(outcome(&caller, &format!("{SERVICE}DeleteSession"), delete, None).await, "OK");
        }
    }
}

/// A request for a session of a small scene.
fn scene() -> v1::CreateSessionRequest {
    v1::CreateSessionRequest { scene: Some(Scene::SceneText(sheet(3))), ..request() }
}

/// A limit, set so low that the request of a method is beyond it.
struct Beyond {
    setting: &'static str,
    lower: fn(&mut Limits),
    method: &'static str,
    /// The request, which may name a session.
    request: fn(String) -> Vec<u8>,
}

/// Limits on what one request asks for. Those on connections and calls leave no status, or let the caller wait.
const BEYOND: &[Beyond] = &[
    Beyond {
        setting: "--max-sessions",
        lower: |limits| limits.max_sessions = 0,
        method: "CreateSession",
        request: |_| scene().encode_to_vec(),
    },
    Beyond {
        setting: "--max-particles",
        lower: |limits| limits.max_particles = 8,
        method: "CreateSession",
        request: |_| scene().encode_to_vec(),
    },
    Beyond {
        setting: "--max-springs",
        lower: |limits| limits.max_springs = 1,
        method: "CreateSession",
        request: |_| scene().encode_to_vec(),
    },
    Beyond {
        setting: "--max-scene-bytes",
        lower: |limits| limits.max_scene_bytes = 100,
        method: "CreateSession",
        request: |_| scene().encode_to_vec(),
    },
    Beyond {
        setting: "--max-threads-per-session",
        lower: |limits| limits.max_threads_per_session = 1,
        method: "CreateSession",
        request: |_| v1::CreateSessionRequest { thread_count: 2, ..scene() }.encode_to_vec(),
    },
    Beyond {
        setting: "--max-uploads",
        lower: |limits| limits.max_uploads = 0,
        method: "UploadMesh",
        request: |_| upload().encode_to_vec(),
    },
    Beyond {
        setting: "--max-mesh-bytes",
        lower: |limits| limits.max_mesh_bytes = 1,
        method: "UploadMesh",
        request: |_| upload().encode_to_vec(),
    },
    Beyond {
        setting: "--max-steps-per-call",
        lower: |limits| limits.max_steps_per_call = 1,
        method: "StepSession",
        request: |session_id| {
            v1::StepSessionRequest { session_id, step_count: 2, ..Default::default() }.encode_to_vec()
        },
    },
    Beyond {
        setting: "--max-changes-per-call",
        lower: |limits| limits.max_changes_per_call = 0,
        method: "UpdateParameters",
        request: |id| change(id).encode_to_vec(),
    },
    Beyond {
        setting: "--max-pending-changes",
        lower: |limits| limits.max_pending_changes = 0,
        method: "UpdateParameters",
        request: |id| change(id).encode_to_vec(),
    },
    Beyond {
        setting: "--max-watchers",
        lower: |limits| limits.max_watchers_per_session = 0,
        method: "WatchFrames",
        request: |session_id| v1::WatchFramesRequest { session_id, ..Default::default() }.encode_to_vec(),
    },
    Beyond {
        setting: "--max-watchers",
        lower: |limits| limits.max_watchers_per_session = 0,
        method: "WatchDiagnostics",
        request: |session_id| {
            v1::WatchDiagnosticsRequest { session_id, ..Default::default() }.encode_to_vec()
        },
    },
];

/// The start of an upload of some points.
fn upload() -> v1::UploadMeshRequest {
    let header = v1::MeshHeader { name: "points".into(), point_count: 100, ..Default::default() };
    v1::UploadMeshRequest { part: Some(Part::Header(header)) }
}

/// A change that waits for a step.
fn change(session_id: String) -> v1::UpdateParametersRequest {
    let springs = vec![v1::SpringUpdate { stiffness: Some(10.0), ..Default::default() }];
    v1::UpdateParametersRequest { session_id, at_step: 1000, springs, ..Default::default() }
}

async fn limits(page: &mut String) {
    page.push_str("\n## Beyond a limit\n\n| limit | method | answer |\n|---|---|---|\n");
    for Beyond { setting, lower, method, request } in BEYOND {
        let mut limits = Limits::default();
        lower(&mut limits);
        let mut server = Server::with(limits).await;
        // What makes no session needs none.
        let id = if *method == "CreateSession" || *method == "UploadMesh" {
            String::new()
        } else {
            server.session(sheet(3)).await
        };
        let caller = channel(&server.app).await;
        let answer = outcome(&caller, &format!("{SERVICE}{method}"), request(id), None).await;
        writeln!(page, "| `{setting}` | `{method}` | {answer} |").expect("a string");
    }
}

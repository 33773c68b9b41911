//! Every method refuses bad input with a status that carries a reason of docs/errors.md.

use std::collections::BTreeSet;

use nappe_proto::v1::{self, create_session_request::Scene};
use nappe_server::Reason;
use prost::Message as _;
use tonic::{Response, Status};
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::sheet,
    harness::{Client, Server, assert_reason, every, latest, request},
};

/// A method, what it answered, and the reason that it should give.
type Refusal = (&'static str, Status, Reason);

fn refused<T: std::fmt::Debug>(
    method: &'static str,
    answer: Result<Response<T>, Status>,
    reason: Reason,
) -> Refusal {
    (method, answer.expect_err("the input is bad"), reason)
}

/// Calls with ids that are not ids, and ids of no session.
async fn with_bad_ids(c: &mut Client) -> Vec<Refusal> {
    let mut all = Vec::new();
    for (id, reason) in
        [("", Reason::InvalidField), ("No Id", Reason::InvalidField), ("nobody", Reason::SessionNotFound)]
    {
        let session_id = || id.to_owned();
        let get = v1::GetSessionRequest::of(session_id());
        all.push(refused("GetSession", c.get_session(get).await, reason));
        let delete = v1::DeleteSessionRequest::of(session_id());
        all.push(refused("DeleteSession", c.delete_session(delete).await, reason));
        let play = v1::PlaySessionRequest::of(session_id());
        all.push(refused("PlaySession", c.play_session(play).await, reason));
        let pause = v1::PauseSessionRequest::of(session_id());
        all.push(refused("PauseSession", c.pause_session(pause).await, reason));
        let list = v1::ListPendingChangesRequest::of(session_id());
        all.push(refused("ListPendingChanges", c.list_pending_changes(list).await, reason));
        let reset = v1::ResetSessionRequest::of(session_id());
        all.push(refused("ResetSession", c.reset_session(reset).await, reason));
        let drop = v1::DropPendingChangesRequest::of(session_id());
        all.push(refused("DropPendingChanges", c.drop_pending_changes(drop).await, reason));
        let fork = v1::ForkSessionRequest::of(session_id());
        all.push(refused("ForkSession", c.fork_session(fork).await, reason));
        let save = v1::SaveSessionRequest::of(session_id());
        all.push(refused("SaveSession", c.save_session(save).await, reason));
        let step = v1::StepSessionRequest::of(session_id());
        all.push(refused("StepSession", c.step_session(step).await, reason));
        let stop = v1::StopSessionRequest::of(session_id());
        all.push(refused("StopSession", c.stop_session(stop).await, reason));
        let update = v1::UpdateParametersRequest { session_id: session_id(), ..Default::default() };
        all.push(refused("UpdateParameters", c.update_parameters(update).await, reason));
        all.push(refused("WatchFrames", c.watch_frames(latest(id)).await, reason));
        let diagnostics = v1::WatchDiagnosticsRequest::of(session_id());
        all.push(refused("WatchDiagnostics", c.watch_diagnostics(diagnostics).await, reason));
    }
    all
}

/// Calls to a session with fields out of range.
async fn with_bad_fields(c: &mut Client, id: &str) -> Vec<Refusal> {
    let mut all = Vec::new();
    for real_time_factor in [-1.0, f64::NAN, f64::INFINITY, 1e7] {
        let play = v1::PlaySessionRequest { real_time_factor, ..v1::PlaySessionRequest::of(id) };
        all.push(refused("PlaySession", c.play_session(play).await, Reason::InvalidField));
    }

    let step = v1::StepSessionRequest { step_count: u64::MAX, wait: false, ..v1::StepSessionRequest::of(id) };
    all.push(refused("StepSession", c.step_session(step).await, Reason::InvalidField));
    for watch in [
        v1::WatchFramesRequest { max_rate_hz: f64::NAN, ..latest(id) },
        v1::WatchFramesRequest { max_rate_hz: -5.0, ..latest(id) },
        v1::WatchFramesRequest { from_frame: Some(0), ..latest(id) },
        v1::WatchFramesRequest { max_rate_hz: 10.0, ..every(id, 0) },
        v1::WatchFramesRequest { delivery: 77, ..latest(id) },
        v1::WatchFramesRequest { encoding: 77, ..latest(id) },
        v1::WatchFramesRequest { fields: vec![77], ..latest(id) },
        v1::WatchFramesRequest { fields: vec![0], ..latest(id) },
    ] {
        all.push(refused("WatchFrames", c.watch_frames(watch).await, Reason::InvalidField));
    }

    let diagnostics =
        v1::WatchDiagnosticsRequest { max_rate_hz: -1.0, ..v1::WatchDiagnosticsRequest::of(id) };
    all.push(refused("WatchDiagnostics", c.watch_diagnostics(diagnostics).await, Reason::InvalidField));
    let list = v1::ListSessionsRequest { page_size: -1, ..Default::default() };
    all.push(refused("ListSessions", c.list_sessions(list).await, Reason::InvalidField));
    let list = v1::ListSessionsRequest { page_token: "?".into(), ..Default::default() };
    all.push(refused("ListSessions", c.list_sessions(list).await, Reason::InvalidPageToken));
    all
}

async fn with_bad_scenes(c: &mut Client) -> Vec<Refusal> {
    let text = |text: &str| Some(Scene::SceneText(text.into()));
    let good = Some(Scene::SceneText(sheet(3)));
    let cases = [
        (request(), Reason::InvalidField),
        (
            v1::CreateSessionRequest { scene: Some(Scene::SceneName("none".into())), ..request() },
            Reason::SceneNotFound,
        ),
        (v1::CreateSessionRequest { scene: text("= ?"), ..request() }, Reason::InvalidScene),
        (v1::CreateSessionRequest { scene: text(""), ..request() }, Reason::InvalidScene),
        (
            v1::CreateSessionRequest { session_id: "A_B".into(), scene: good.clone(), ..request() },
            Reason::InvalidField,
        ),
        (v1::CreateSessionRequest { precision: 9, scene: good.clone(), ..request() }, Reason::InvalidField),
        (
            v1::CreateSessionRequest { thread_count: 100_000, scene: good.clone(), ..request() },
            Reason::InvalidField,
        ),
        (
            v1::CreateSessionRequest { request_id: "no uuid".into(), scene: good, ..request() },
            Reason::InvalidField,
        ),
    ];

    let mut all = Vec::new();
    for (create, reason) in cases {
        all.push(refused("CreateSession", c.create_session(create).await, reason));
    }

    let upload = c.upload_mesh(tokio_stream::iter([v1::UploadMeshRequest { part: None }])).await;
    all.push(refused("UploadMesh", upload, Reason::InvalidUpload));
    let begin = c.begin_upload(v1::BeginUploadRequest { header: None }).await;
    all.push(refused("BeginUpload", begin, Reason::InvalidField));
    let append = v1::AppendUploadRequest { upload_id: "none".into(), ..v1::AppendUploadRequest::default() };
    all.push(refused("AppendUpload", c.append_upload(append).await, Reason::UploadNotFound));
    let finish = v1::FinishUploadRequest { upload_id: "none".into() };
    all.push(refused("FinishUpload", c.finish_upload(finish).await, Reason::UploadNotFound));
    let open = v1::OpenLinkRequest { code: "none".into() };
    all.push(refused("OpenLink", c.open_link(open).await, Reason::LinkNotFound));
    all
}

#[tokio::test(flavor = "multi_thread")]
async fn every_method_refuses_bad_input_with_a_reason() {
    let mut server = Server::start().await;
    let id = server.session(sheet(3)).await;
    let mut refusals = with_bad_ids(&mut server.client).await;
    refusals.extend(with_bad_fields(&mut server.client, &id).await);
    refusals.extend(with_bad_scenes(&mut server.client).await);
    for (method, status, reason) in &refusals {
        println!("{method}: {}", status.message());
        assert_reason(status, *reason);
        if *reason == Reason::InvalidField {
            let bad = status.get_details_bad_request().expect("the invalid fields are named");
            assert!(!bad.field_violations.is_empty(), "{method}");
        }
    }

    // No method is left out but those that take no input.
    let tested: BTreeSet<&str> = refusals.iter().map(|(method, ..)| *method).collect();
    let files = prost_types::FileDescriptorSet::decode(v1::FILE_DESCRIPTOR_SET).expect("descriptors");
    let methods = files.file.iter().flat_map(|file| &file.service).flat_map(|service| &service.method);
    for method in methods
        .map(prost_types::MethodDescriptorProto::name)
        .filter(|name| !["GetServerInfo", "MakeLink"].contains(name))
    {
        assert!(tested.contains(method), "{method} is not tested with bad input");
    }

    // And nothing happened to the session.
    assert_eq!(server.get(&id).await.step, 0);
}

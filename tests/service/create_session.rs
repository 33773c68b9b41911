//! CreateSession: options win over the scene, ids are unique, a repeated request makes one session.

use nappe_proto::v1::{self, Precision, create_session_request::Scene};
use nappe_server::Reason;

use crate::{
    cloth_scenes::{sheet, sheet_with},
    harness::{Server, assert_reason, request},
};

fn named(id: &str, text: String) -> v1::CreateSessionRequest {
    v1::CreateSessionRequest { session_id: id.into(), scene: Some(Scene::SceneText(text)), ..request() }
}

#[tokio::test(flavor = "multi_thread")]
async fn options_of_the_request_win_over_the_scene() {
    let mut server = Server::start().await;
    let text = sheet_with(4, "steps = 100\nframe_interval = 5\nprecision = \"f32\"");
    let plain = server.create(named("plain", text.clone())).await;
    let plain = server.get(&plain).await;
    assert_eq!((plain.step_limit, plain.frame_interval_steps, plain.precision()), (100, 5, Precision::F32));
    let other = server
        .create(v1::CreateSessionRequest {
            precision: Precision::F64.into(),
            step_limit: Some(7),
            frame_interval_steps: 2,
            ..named("other", text)
        })
        .await;
    let other = server.get(&other).await;
    assert_eq!((other.step_limit, other.frame_interval_steps, other.precision()), (7, 2, Precision::F64));

    // Steps past the limit end at it, and the last step makes a frame though 7 is odd.
    let finished = server.step("other", 50).await;
    assert_eq!((finished.step, finished.frame, finished.state()), (7, 4, v1::SessionState::Finished));
}

#[tokio::test(flavor = "multi_thread")]
async fn the_same_request_id_makes_one_session() {
    let mut server = Server::start().await;
    let wanted = v1::CreateSessionRequest {
        session_id: String::new(),
        request_id: "0b5a0a5e-4a52-4ee5-9d5c-3b8f1a4f2c11".into(),
        ..named("", sheet(12))
    };
    let calls: Vec<_> = (0..4)
        .map(|_| {
            let (mut client, wanted) = (server.client.clone(), wanted.clone());
            tokio::spawn(async move { client.create_session(wanted).await })
        })
        .collect();

    let mut ids = Vec::new();
    for call in calls {
        let made = call.await.expect("no panic").expect("made once").into_inner();
        ids.push(made.session.expect("a session").session_id);
    }

    ids.dedup();
    assert_eq!(ids.len(), 1, "one session: {ids:?}");

    let other = v1::CreateSessionRequest { scene: Some(Scene::SceneText(sheet(5))), ..wanted.clone() };
    let refused = server.client.create_session(other).await.expect_err("other fields");
    assert_eq!(assert_reason(&refused, Reason::RequestIdReused)["session_id"], ids[0]);

    // Once the session is deleted, the id is free.
    server.client.delete_session(v1::DeleteSessionRequest::of(&ids[0])).await.expect("deleted");
    assert_ne!(server.create(wanted).await, ids[0]);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_id_belongs_to_one_session() {
    let mut server = Server::start().await;
    server.create(named("mine", sheet(3))).await;
    let refused = server.client.create_session(named("mine", sheet(3))).await.expect_err("taken");
    assert_reason(&refused, Reason::SessionExists);

    // A creation that failed gives the id back.
    let broken = named("yours", "version = 1".into());
    assert_reason(&server.client.create_session(broken).await.expect_err("no body"), Reason::InvalidScene);
    server.create(named("yours", sheet(3))).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_error_in_a_scene_is_told_with_its_line_and_field() {
    let mut server = Server::start().await;
    let text = sheet(4).replace("dt = 0.002", "dt = -1");
    let refused = server.client.create_session(named("", text)).await.expect_err("dt is negative");
    let metadata = assert_reason(&refused, Reason::InvalidScene);
    assert_eq!((metadata["field"].as_str(), metadata["line"].as_str()), ("dt", "4"));
    assert_eq!(metadata["violation"], "OUT_OF_RANGE");
    let text = sheet(4).replace("drag", "drug");
    let refused = server.client.create_session(named("", text)).await.expect_err("unknown field");
    assert_reason(&refused, Reason::InvalidScene);
    assert!(refused.message().contains("drag"), "the nearest name is offered: {}", refused.message());
    let text = sheet(4).replace("grid = [4, 4], spacing = 0.1, ripple = 0.01", "file = \"/etc/passwd\"");
    let refused = server.client.create_session(named("", text)).await.expect_err("no files");
    assert_reason(&refused, Reason::MeshNotFound);
}

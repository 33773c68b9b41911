//! A session's uid: who asks for a session that is gone is not given another of the same id.

use std::time::{Duration, SystemTime};

use nappe_proto::v1;
use nappe_server::Reason;
use tonic::Status;

use crate::{
    cloth_scenes::sheet,
    harness::{Client, Server, assert_reason, every, request},
};

/// Every call that names a session, by its id and uid; why each was refused.
async fn calls(client: &mut Client, id: &str, session_uid: &str) -> Vec<Option<Status>> {
    let session_uid = session_uid.to_owned();
    macro_rules! refusals {
        ($($method:ident $request:expr;)*) => {
            vec![$({
                let mut request = $request;
                request.session_uid.clone_from(&session_uid);
                client.$method(request).await.err()
            },)*]
        };
    }
    refusals! {
        get_session v1::GetSessionRequest::of(id);
        fork_session v1::ForkSessionRequest::of(id);
        update_parameters v1::UpdateParametersRequest { drag: Some(0.1), ..v1::UpdateParametersRequest::of(id) };
        step_session v1::StepSessionRequest { wait: true, ..v1::StepSessionRequest::of(id) };
        play_session v1::PlaySessionRequest::of(id);
        pause_session v1::PauseSessionRequest::of(id);
        watch_frames every(id, 0);
        watch_diagnostics v1::WatchDiagnosticsRequest::of(id);
        stop_session v1::StopSessionRequest::of(id);
        delete_session v1::DeleteSessionRequest::of(id);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_for_a_session_that_is_gone_does_not_reach_another_of_its_id() {
    let mut server = Server::start().await;
    let named = || v1::CreateSessionRequest {
        session_id: "the-same".into(),
        scene: Some(v1::create_session_request::Scene::SceneText(sheet(4))),
        ..request()
    };
    let id = server.create(named()).await;
    let first = server.get(&id).await;
    server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("deleted");
    server.create(named()).await;
    let second = server.get(&id).await;
    assert_eq!(first.uid.len(), 36, "a UUID: {}", first.uid);
    assert_ne!(first.uid, second.uid);

    let refused = calls(&mut server.client, &id, &first.uid).await;
    assert_eq!(refused.len(), 10);
    for status in refused {
        let metadata = assert_reason(&status.expect("the session is gone"), Reason::SessionReplaced);
        assert_eq!((&metadata["session_uid"], &metadata["expected_uid"]), (&second.uid, &first.uid));
    }
    assert_eq!(server.get(&id).await.step, 0, "none of the calls did anything");

    let accepted = calls(&mut server.client, &id, &second.uid).await;
    assert!(accepted.iter().all(Option::is_none), "{accepted:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_says_when_it_was_made() {
    let mut server = Server::start().await;
    let before = SystemTime::now();
    let id = server.session(sheet(4)).await;
    let made = SystemTime::try_from(server.get(&id).await.create_time.expect("a time")).expect("a time");
    assert!(made + Duration::from_secs(1) > before && made <= SystemTime::now() + Duration::from_secs(1));
    server.step(&id, 2).await;
    assert_eq!(SystemTime::try_from(server.get(&id).await.create_time.expect("a time")), Ok(made));
}

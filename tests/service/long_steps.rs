//! A step that takes minutes: calls are accepted at once, and whoever stops, deletes or shuts down does not wait for
//! its end.

use nappe_proto::v1::{self, SessionState};
use nappe_server::Reason;

use crate::{
    cloth_scenes::sheet_with,
    frames::in_time,
    harness::{Server, assert_reason, connect, every},
    snow_scenes::snow_with,
};

/// Cloth whose step takes minutes: ten thousand implicit steps of 90 000 particles.
fn cloth() -> String {
    sheet_with(300, "").replace("drag = 1e-4", "drag = 1e-4\nsubsteps = 10000")
}

/// Snow whose step takes minutes: a million steps of the snow.
fn snow() -> String {
    snow_with("", "substep = 1e-6\nmax_substeps = 1000000").replace("dt = 0.041666666666666664", "dt = 0.99")
}

fn step(id: &str) -> v1::StepSessionRequest {
    v1::StepSessionRequest { session_id: id.into(), step_count: 5, ..v1::StepSessionRequest::default() }
}

#[tokio::test(flavor = "multi_thread")]
async fn calls_are_accepted_at_once_and_say_when_they_take_effect() {
    let mut server = Server::start().await;
    let id = server.session(cloth()).await;
    server.mark_first_step(&id).await;
    server.client.step_session(step(&id)).await.expect("accepted");
    server.until_marked_step(&id).await;

    let wind = v1::UpdateParametersRequest {
        session_id: id.clone(),
        wind: Some([1.0, 0.0, 0.0].into()),
        ..v1::UpdateParametersRequest::default()
    };
    let accepted = server.client.update_parameters(wind).await.expect("accepted").into_inner();
    assert_eq!((accepted.effective_step, accepted.order), (1, 2), "the first step has begun");

    let pause = v1::PauseSessionRequest { session_id: id.clone(), ..v1::PauseSessionRequest::default() };
    let paused = server.client.pause_session(pause).await.expect("accepted").into_inner();
    let session = paused.session.expect("the answer has the session");
    assert_eq!((paused.effective_step, session.step, session.state()), (1, 0, SessionState::Paused));
    assert_eq!(session.state_hash, None, "it does not stand yet");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_gives_a_long_step_up_and_the_newest_frame_is_the_last() {
    for scene in [cloth(), snow()] {
        let mut server = Server::start().await;
        let id = server.session(scene).await;
        let made = server.get(&id).await;
        server.mark_first_step(&id).await;
        server.play(&id).await;
        server.until_marked_step(&id).await;

        let stop = v1::StopSessionRequest::of(&id);
        let stopped = server.client.stop_session(stop).await.expect("stopped").into_inner();
        let stopped = stopped.session.expect("the answer has the session");
        assert_eq!((stopped.state(), stopped.step, stopped.failure), (SessionState::Finished, 0, None));

        let (frames, end) = server.watch(every(&id, 0)).await.until_end().await;
        assert_eq!((frames.len(), end.frame, Some(end.state_hash)), (1, 0, made.state_hash));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_deleted_within_a_long_step_is_gone_with_its_thread() {
    let mut server = Server::start().await;
    for scene in [cloth(), snow()] {
        let id = server.session(scene).await;
        server.mark_first_step(&id).await;
        let mut other = server.client.clone();
        let waits = v1::StepSessionRequest { wait: true, ..step(&id) };
        let waiting = tokio::spawn(async move { other.step_session(waits).await });
        server.until_marked_step(&id).await;

        // The answer comes when the thread has ended: in less time than a step takes, or the call fails.
        server.client.delete_session(v1::DeleteSessionRequest::of(id)).await.expect("deleted");
        let status = in_time(waiting).await.expect("no panic").expect_err("the steps are not taken");
        assert_reason(&status, Reason::SessionDeleted);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_shutdown_gives_long_steps_up_and_tells_those_who_wait() {
    let mut server = Server::start().await;
    let mut waiting = Vec::new();
    for scene in [cloth(), snow()] {
        let id = server.session(scene).await;
        server.mark_first_step(&id).await;
        let mut other = connect(&server.app).await;
        let waits = v1::StepSessionRequest { wait: true, ..step(&id) };
        waiting.push(tokio::spawn(async move { other.step_session(waits).await }));
        server.until_marked_step(&id).await;
    }

    in_time(server.app.shutdown()).await;
    for waiting in waiting {
        let status = in_time(waiting).await.expect("no panic").expect_err("the steps are not taken");
        assert_reason(&status, Reason::ServerDraining);
    }
}

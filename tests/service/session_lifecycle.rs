//! Every method once, as it is meant to be used: create, get, list, play, pause, step, stop, delete.

use std::time::Instant;

use nappe_proto::v1::{self, SessionState, create_session_request::Scene};
use nappe_server::Reason;

use crate::{
    cloth_scenes::{sheet, sheet_with},
    harness::{Server, assert_reason, every, request},
};

#[tokio::test(flavor = "multi_thread")]
async fn a_session_goes_through_its_states() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(6, "steps = 40\nframe_interval = 4")).await;
    let made = server.get(&id).await;
    assert_eq!((made.state(), made.step, made.frame), (SessionState::Paused, 0, 0));
    assert_eq!((made.particle_count, made.frame_interval_steps, made.step_limit), (36, 4, 40));
    assert!(
        made.state_hash.is_some()
            && made.spring_count > 60
            && made.snow_particle_count == 0
            && made.dt_seconds > 0.0
    );

    let stepped = server.step(&id, 10).await;
    assert_eq!((stepped.state(), stepped.step, stepped.frame), (SessionState::Paused, 10, 2));
    assert!((stepped.time_seconds - 0.02).abs() < 1e-12 && stepped.state_hash != made.state_hash);
    assert!(stepped.diagnostics.as_ref().is_some_and(|d| d.step == 10 && d.kinetic_energy > 0.0));
    assert!(stepped.stepping_seconds > 0.0);

    server.play(&id).await;
    let finished = server.until(&id, |session| session.state() == SessionState::Finished).await;
    assert_eq!((finished.step, finished.frame), (40, 10));

    let late = server.client.play_session(v1::PlaySessionRequest::of(&id));
    assert_reason(&late.await.expect_err("it is finished"), Reason::SessionFinished);

    // A pause that comes too late changes nothing.
    assert_eq!(server.pause(&id).await, server.get(&id).await);

    server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("deleted");
    let gone = server.client.get_session(v1::GetSessionRequest::of(id)).await;
    assert_reason(&gone.expect_err("it is deleted"), Reason::SessionNotFound);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_plays_pauses_plays_on_and_stops() {
    let mut server = Server::start().await;
    let id = server.session(sheet(6)).await;
    server.play(&id).await;
    server.until(&id, |session| session.step > 20).await;
    let paused = server.pause(&id).await;
    assert_eq!(paused.state(), SessionState::Paused);
    assert_eq!(server.get(&id).await, paused, "a paused session stands still");

    // The hash is that of the very step at which it paused: the same steps give it again.
    let again = server.session(sheet(6)).await;
    assert_eq!(server.step(&again, paused.step).await.state_hash, paused.state_hash);

    server.play(&id).await;
    let refused = v1::StepSessionRequest { step_count: 1, wait: false, ..v1::StepSessionRequest::of(&id) };
    let refused = server.client.step_session(refused).await.expect_err("it plays without an end");
    assert_reason(&refused, Reason::SessionPlaying);
    server.until(&id, |session| session.step > paused.step).await;
    let stopped = server.client.stop_session(v1::StopSessionRequest::of(&id)).await;
    let stopped = stopped.expect("stopped").into_inner().session.expect("a session");
    assert_eq!(stopped.state(), SessionState::Finished);
    let (frames, end) = server.watch(every(&id, stopped.frame)).await.until_end().await;
    assert_eq!(frames.last().expect("the last frame").head.step, stopped.step);
    assert_eq!((Some(end.state_hash), end.step), (stopped.state_hash, stopped.step));
}

#[tokio::test(flavor = "multi_thread")]
async fn steps_without_waiting_add_up() {
    let mut server = Server::start().await;
    let id = server.session(sheet(6)).await;
    for _ in 0..5 {
        let request =
            v1::StepSessionRequest { step_count: 3, wait: false, ..v1::StepSessionRequest::of(&id) };
        server.client.step_session(request).await.expect("accepted");
    }

    let done = server.until(&id, |session| session.state() == SessionState::Paused).await;
    assert_eq!(done.step, 15);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pause_interrupts_those_who_wait_for_steps() {
    let mut server = Server::start().await;
    let id = server.session(sheet(6)).await;
    let mut other = server.client.clone();
    let request =
        v1::StepSessionRequest { step_count: 5_000_000, wait: true, ..v1::StepSessionRequest::of(&id) };
    let waiting = tokio::spawn(async move { other.step_session(request).await });
    server.until(&id, |session| session.step > 0).await;
    server.pause(&id).await;
    let status = waiting.await.expect("no panic").expect_err("the steps are not taken");
    assert_reason(&status, Reason::StepsInterrupted);
}

#[tokio::test(flavor = "multi_thread")]
async fn real_time_never_runs_ahead_of_the_clock() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    let start = Instant::now();
    let play = v1::PlaySessionRequest { real_time_factor: 0.5, ..v1::PlaySessionRequest::of(&id) };
    server.client.play_session(play).await.expect("it plays");

    // 0.2 s of simulated time at half speed are 0.4 s of wall clock.
    let reached = server.until(&id, |session| session.time_seconds >= 0.2).await;
    let elapsed = start.elapsed().as_secs_f64();
    assert!(reached.time_seconds <= 0.5 * elapsed + 0.002, "{} s after {elapsed} s", reached.time_seconds);
}

#[tokio::test(flavor = "multi_thread")]
async fn every_shipped_scene_can_be_created_and_stepped() {
    let mut server = Server::start().await;
    let info = server.client.get_server_info(v1::GetServerInfoRequest {}).await.expect("info").into_inner();
    assert!(info.scenes.iter().any(|name| name == "demo"), "{:?}", info.scenes);
    for name in info.scenes {
        let id = server
            .create(v1::CreateSessionRequest { scene: Some(Scene::SceneName(name.clone())), ..request() })
            .await;
        assert_eq!(server.step(&id, 2).await.step, 2, "{name}");
        // There are more scenes than sessions that a server has at once.
        server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("it is deleted");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_are_listed_in_pages_in_the_order_of_their_ids() {
    let mut server = Server::start().await;
    let ids = ["delta", "alpha", "echo", "bravo", "charlie"];
    for id in ids {
        let scene = Some(Scene::SceneText(sheet(3)));
        server.create(v1::CreateSessionRequest { session_id: id.into(), scene, ..request() }).await;
    }

    let (mut seen, mut pages, mut token) = (Vec::new(), 0, String::new());
    loop {
        let request = v1::ListSessionsRequest { page_size: 2, page_token: token };
        let page = server.client.list_sessions(request).await.expect("a page").into_inner();
        assert!(page.sessions.len() <= 2);
        seen.extend(page.sessions.into_iter().map(|session| session.session_id));
        (pages, token) = (pages + 1, page.next_page_token);
        if token.is_empty() {
            break;
        }
    }

    assert_eq!((seen, pages), (["alpha", "bravo", "charlie", "delta", "echo"].map(String::from).to_vec(), 3));
    let all = v1::ListSessionsRequest { page_size: 5000, page_token: String::new() };
    assert_eq!(server.client.list_sessions(all).await.expect("a page").into_inner().sessions.len(), 5);
}

#[tokio::test(flavor = "multi_thread")]
async fn steps_up_to_a_number_can_be_asked_for_again() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(4, "steps = 20")).await;
    let to = |to_step, wait| v1::StepSessionRequest {
        to_step: Some(to_step),
        wait,
        ..v1::StepSessionRequest::of(&id)
    };
    for (to_step, expected) in [(7, 7), (7, 7), (3, 7), (0, 7), (8, 8)] {
        let stepped = server.client.step_session(to(to_step, true)).await.expect("stepped").into_inner();
        let session = stepped.session.expect("the session");
        assert_eq!((session.step, session.state()), (expected, SessionState::Paused), "to {to_step}");
    }

    // Asked for twice at once, the steps are taken once; the longer way is the one that is gone.
    let calls = [12, 15, 15, 10].map(|to_step| {
        let (mut client, request) = (server.client.clone(), to(to_step, true));
        tokio::spawn(async move { client.step_session(request).await })
    });
    for call in calls {
        call.await.expect("no panic").expect("stepped");
    }
    assert_eq!(server.get(&id).await.step, 15);

    // Also a session that came to its end with the call that is repeated.
    for _ in 0..2 {
        let stepped = server.client.step_session(to(20, true)).await.expect("stepped").into_inner();
        assert_eq!(stepped.session.expect("the session").state(), SessionState::Finished);
    }
    let refused = server.client.step_session(to(21, true)).await.expect_err("beyond the end");
    assert_reason(&refused, Reason::SessionFinished);
    let both = v1::StepSessionRequest { step_count: 1, ..to(25, false) };
    let refused = server.client.step_session(both).await.expect_err("one or the other");
    assert_eq!(assert_reason(&refused, Reason::InvalidField)["field"], "to_step");
    let far = server.client.step_session(to(u64::MAX, false)).await.expect_err("too far");
    assert_eq!(assert_reason(&far, Reason::InvalidField)["field"], "to_step");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_can_be_told_never_to_end() {
    let mut server = Server::start().await;
    let scene = Scene::SceneText(sheet_with(4, "steps = 5"));
    for (step_limit, expected) in [(None, 5), (Some(0), 0), (Some(9), 9)] {
        let request = v1::CreateSessionRequest { scene: Some(scene.clone()), step_limit, ..request() };
        let id = server.create(request).await;
        assert_eq!(server.get(&id).await.step_limit, expected);
        if step_limit == Some(0) {
            let session = server.step(&id, 12).await;
            assert_eq!((session.step, session.state()), (12, SessionState::Paused));
        }
    }
}

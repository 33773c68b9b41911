//! Several who control one session: changes have an order, can be listed and dropped, and a run is repeated exactly
//! from what the calls answered.

use std::time::Duration;

use nappe_proto::v1::{self, SessionState};
use nappe_server::{Limits, Reason};
use nappe_tests::Random;

use crate::{
    cloth_scenes::{sheet, sheet_with},
    frames::in_time,
    harness::{Client, Server, assert_reason, connect, every},
};

fn update(id: &str, at_step: u64, drag: f64) -> v1::UpdateParametersRequest {
    let drag = Some(drag);
    v1::UpdateParametersRequest { session_id: id.into(), at_step, drag, ..Default::default() }
}

/// Changes, pauses, plays and steps at random. Returns what was accepted of the changes.
async fn control(
    mut client: Client,
    id: String,
    seed: u64,
    calls: usize,
) -> Vec<(v1::UpdateParametersResponse, v1::UpdateParametersRequest)> {
    let (mut random, mut accepted) = (Random::seeded(seed), Vec::new());
    let mut below = move |count: u64| random.between(0.0, count as f64) as u64;
    for _ in 0..calls {
        match below(10) {
            0 => {
                let pause = v1::PauseSessionRequest {
                    session_id: id.clone(),
                    wait: below(2) == 0,
                    ..Default::default()
                };
                client.pause_session(pause).await.expect("it pauses");
            }
            1..3 => {
                let play = v1::PlaySessionRequest::of(&id);
                client.play_session(play).await.expect("it plays");
            }
            3 => {
                // Refused while it plays, cut short by the other.
                let step = v1::StepSessionRequest {
                    session_id: id.clone(),
                    step_count: 1 + below(5),
                    ..Default::default()
                };
                let _ = client.step_session(step).await;
            }
            _ => {
                let ahead = below(40);
                let now = v1::GetSessionRequest::of(&id);
                let now = client.get_session(now).await.expect("it is there").into_inner();
                let step = now.session.expect("the answer has the session").step;
                let at_step = if ahead < 20 { 0 } else { step + ahead };
                let request = update(&id, at_step, 1e-4 * (1 + below(100)) as f64);
                let answer = client.update_parameters(request.clone()).await.expect("accepted");
                accepted.push((answer.into_inner(), request));
            }
        }
    }
    accepted
}

#[tokio::test(flavor = "multi_thread")]
async fn two_who_control_one_session_at_random_can_be_repeated_exactly() {
    let mut server = Server::start().await;
    let id = server.session(sheet(12)).await;
    let (first, second) = (connect(&server.app).await, connect(&server.app).await);
    let (first, second) =
        tokio::join!(control(first, id.clone(), 11, 500), control(second, id.clone(), 12, 500));
    let stood = server.pause(&id).await;

    // A quiet run with the same changes at the same steps, in the order that the answers tell.
    let mut changes: Vec<_> = first.into_iter().chain(second).collect();
    changes.sort_by_key(|(accepted, _)| (accepted.effective_step, accepted.order));
    assert!(
        changes.len() > 500
            && changes.windows(2).any(|pair| pair[0].0.effective_step == pair[1].0.effective_step)
    );
    let quiet = server.session(sheet(12)).await;
    for (accepted, request) in changes {
        let request = v1::UpdateParametersRequest {
            session_id: quiet.clone(),
            at_step: accepted.effective_step,
            ..request
        };
        let again = server.client.update_parameters(request).await.expect("accepted").into_inner();
        assert_eq!(again.effective_step, accepted.effective_step);
    }
    assert!(stood.step > 0);
    assert_eq!(server.step(&quiet, stood.step).await.state_hash, stood.state_hash);
}

#[tokio::test(flavor = "multi_thread")]
async fn changes_that_wait_are_listed_in_pages_and_dropped() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    for at_step in [50, 20, 50, 70] {
        server.client.update_parameters(update(&id, at_step, 0.1)).await.expect("accepted");
    }

    let mut client = server.client.clone();
    let mut list = async |page_token: String| {
        let request = v1::ListPendingChangesRequest {
            session_id: id.clone(),
            page_size: 3,
            page_token,
            ..Default::default()
        };
        client.list_pending_changes(request).await.expect("a page").into_inner()
    };
    let first = list(String::new()).await;
    let second = list(first.next_page_token.clone()).await;
    let all: Vec<_> = first.changes.into_iter().chain(second.changes).collect();
    let places: Vec<_> = all
        .iter()
        .map(|change| change.accepted.expect("its place"))
        .map(|a| (a.effective_step, a.order))
        .collect();
    assert_eq!(places, [(20, 2), (50, 1), (50, 3), (70, 4)]);
    assert!(second.next_page_token.is_empty());
    let changes = all[0].changes.clone().expect("its changes");
    assert_eq!((changes.drag, changes.session_id.as_str(), changes.at_step), (Some(0.1), "", 0));

    let bad = v1::ListPendingChangesRequest {
        session_id: id.clone(),
        page_token: "x".into(),
        ..Default::default()
    };
    let refused = server.client.list_pending_changes(bad).await.expect_err("no such token");
    assert_reason(&refused, Reason::InvalidPageToken);

    let drop = |orders: &[u64]| v1::DropPendingChangesRequest {
        session_id: id.clone(),
        orders: orders.to_vec(),
        ..Default::default()
    };
    let dropped = server.client.drop_pending_changes(drop(&[2, 3, 99])).await.expect("dropped");
    assert_eq!(dropped.into_inner().dropped_count, 2);
    let dropped = server.client.drop_pending_changes(drop(&[])).await.expect("dropped");
    assert_eq!(dropped.into_inner().dropped_count, 2);

    // None of them ever takes effect.
    let untouched = server.session(sheet(4)).await;
    let (id, untouched) = (server.step(&id, 80).await, server.step(&untouched, 80).await);
    assert_eq!(id.state_hash, untouched.state_hash);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_update_answers_when_it_takes_effect_if_asked_to_wait() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    let mut other = server.client.clone();
    let waits = v1::UpdateParametersRequest { wait: true, ..update(&id, 5, 0.1) };
    let waiting = tokio::spawn(async move { other.update_parameters(waits).await });
    server.until_pending(&id, 1).await;
    server.step(&id, 5).await;
    tokio::time::sleep(Duration::from_millis(50)).await;
    assert!(!waiting.is_finished(), "step 5 has not begun");
    server.step(&id, 1).await;
    let accepted = in_time(waiting).await.expect("no panic").expect("it took effect");
    assert_eq!(accepted.into_inner().effective_step, 5);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_panic_between_steps_reaches_those_who_wait_for_it() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    server.step(&id, 1).await;
    assert!(server.app.inject_panic(&id));
    let fields = vec![v1::Field::Velocities.into()];
    let watch = v1::WatchFramesRequest { fields, ..every(&id, 1) };
    let status = server.client.watch_frames(watch).await.expect_err("completing the frame panics");
    assert_reason(&status, Reason::SessionPanicked);
    assert_eq!(server.get(&id).await.state(), SessionState::Failed);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_last_frame_of_a_stopped_session_has_its_hash() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(4, "hash_interval = 100\nframe_interval = 1")).await;
    let stood = server.step(&id, 7).await;
    server.client.stop_session(v1::StopSessionRequest::of(&id)).await.expect("stopped");
    let (frames, end) = server.watch(every(&id, 7)).await.until_end().await;
    assert_eq!(frames[0].head.state_hash, stood.state_hash);
    assert_eq!(Some(end.state_hash), stood.state_hash);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_repeated_create_never_returns_a_session_that_is_being_deleted() {
    let mut server = Server::start().await;
    let slow = sheet_with(150, "").replace("drag = 1e-4", "drag = 1e-4\nsubsteps = 10000");
    let request = v1::CreateSessionRequest {
        request_id: "6e0a7c9e-52c5-4a3b-93cf-0fd4b7f2b1aa".into(),
        scene: Some(v1::create_session_request::Scene::SceneText(slow)),
        ..crate::harness::request()
    };
    let id = server.create(request.clone()).await;
    server.mark_first_step(&id).await;
    server.play(&id).await;
    server.until_marked_step(&id).await;
    let mut other = server.client.clone();
    let delete = v1::DeleteSessionRequest::of(&id);
    let deleting = tokio::spawn(async move { other.delete_session(delete).await });
    let made_again = async {
        loop {
            let again = server.create(request.clone()).await;
            if again != id {
                break again;
            }
            tokio::task::yield_now().await;
        }
    };
    let again = in_time(made_again).await;
    in_time(deleting).await.expect("no panic").expect("deleted");
    assert_eq!(server.get(&again).await.state(), SessionState::Paused);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_nobody_uses_says_how_long_it_stays() {
    // Kept for so long that none ends before it is looked at.
    let mut server = Server::with(Limits { idle_session_seconds: 300, ..Limits::default() }).await;
    let (unused, played) = (server.session(sheet(4)).await, server.session(sheet(4)).await);
    let watched = server.session(sheet(4)).await;
    server.play_in_real_time(&played).await;
    let watch = server.watch(every(&watched, 0)).await;
    let listed = listed(&mut server).await;
    let expires = |id: &str| listed.iter().find(|(other, _)| other == id).expect("it is there").1;
    assert!(expires(&unused).is_some_and(|seconds| seconds > 0.0 && seconds <= 300.0), "{listed:?}");
    assert_eq!((expires(&played), expires(&watched)), (None, None), "they are in use");
    drop(watch);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_nobody_uses_goes_and_those_in_use_stay() {
    let mut server = Server::with(Limits { idle_session_seconds: 1, ..Limits::default() }).await;

    // On a busy machine, a session may go before we come to use it.
    let played = loop {
        let id = server.session(sheet(4)).await;
        let play = v1::PlaySessionRequest { real_time_factor: 1.0, ..v1::PlaySessionRequest::of(&id) };
        match server.client.play_session(play).await {
            Ok(_) => break id,
            Err(status) => drop(assert_reason(&status, Reason::SessionNotFound)),
        }
    };
    let (watched, watch) = loop {
        let id = server.session(sheet(4)).await;
        match server.client.watch_frames(every(&id, 0)).await {
            Ok(stream) => break (id, stream),
            Err(status) => drop(assert_reason(&status, Reason::SessionNotFound)),
        }
    };
    let unused = server.session(sheet(4)).await;

    // A list uses no session.
    let left = in_time(async {
        loop {
            let left: Vec<_> = listed(&mut server).await.into_iter().map(|(id, _)| id).collect();
            if !left.contains(&unused) {
                break left;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    });
    let left = left.await;
    assert!(left.contains(&played) && left.contains(&watched), "{left:?}");
    drop(watch);
}

/// Each session, and the seconds that it has left without being used.
async fn listed(server: &mut Server) -> Vec<(String, Option<f64>)> {
    let listed = server.client.list_sessions(v1::ListSessionsRequest::default()).await.expect("a list");
    let sessions = listed.into_inner().sessions.into_iter();
    sessions.map(|session| (session.session_id, session.expires_in_seconds)).collect()
}

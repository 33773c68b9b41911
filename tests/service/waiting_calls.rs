//! Calls that wait for a session which another call has go on: each is answered at its step, or at once.

use nappe_proto::v1::{self, SessionState};
use nappe_server::Reason;

use crate::{
    cloth_scenes::{sheet, sheet_with},
    frames::in_time,
    harness::{Server, assert_reason, connect},
};

/// So slow that no test sees the next step (simulated seconds per second).
pub(crate) const SLOW: f64 = 1e-7;

/// A sheet of so many particles along a side, each step of which is divided into so many.
pub(crate) fn divided(side: u32, substeps: u32) -> String {
    sheet_with(side, "").replace("drag = 1e-4", &format!("drag = 1e-4\nsubsteps = {substeps}"))
}

/// Cloth whose step takes some tenths of a second.
fn slow() -> String {
    divided(60, 200)
}

async fn play_slowly(server: &mut Server, id: &str) {
    let play = v1::PlaySessionRequest { real_time_factor: SLOW, ..v1::PlaySessionRequest::of(id) };
    server.client.play_session(play).await.expect("it plays");
}

fn until_step(id: &str, to_step: u64) -> v1::StepSessionRequest {
    v1::StepSessionRequest { to_step: Some(to_step), wait: true, ..v1::StepSessionRequest::of(id) }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pause_that_a_slow_play_overtakes_is_answered_at_once() {
    let mut server = Server::start().await;
    // Its step takes minutes.
    let id = server.session(divided(300, 10_000)).await;
    server.mark_first_step(&id).await;
    server.play(&id).await;
    server.until_marked_step(&id).await;
    let mut other = connect(&server.app).await;
    let pause = v1::PauseSessionRequest { wait: true, ..v1::PauseSessionRequest::of(&id) };
    let waiting = tokio::spawn(async move { other.pause_session(pause).await });
    server.until(&id, |session| session.state() == SessionState::Paused).await;

    play_slowly(&mut server, &id).await;
    let answer = in_time(waiting).await.expect("no panic").expect("it was paused").into_inner();
    let session = answer.session.expect("the answer has the session");
    assert_eq!((session.state(), session.step), (SessionState::Playing, 0));
    assert_eq!(answer.effective_step, 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn steps_of_which_the_last_has_begun_are_answered_with_their_frame_whoever_plays_since() {
    let mut server = Server::start().await;
    let id = server.session(slow()).await;
    server.mark_first_step(&id).await;
    let mut other = connect(&server.app).await;
    let frame = Some(v1::FrameRequest::default());
    let step = v1::StepSessionRequest { wait: true, frame, ..v1::StepSessionRequest::of(&id) };
    let waiting = tokio::spawn(async move { other.step_session(step).await });
    server.until_marked_step(&id).await;

    play_slowly(&mut server, &id).await;
    let answer = in_time(waiting).await.expect("no panic").expect("the step is taken").into_inner();
    let step = answer.session.expect("the answer has the session").step;
    assert_eq!((step, answer.frame.expect("it was asked for").step), (1, 1));
}

#[tokio::test(flavor = "multi_thread")]
async fn the_step_that_a_playing_session_is_in_can_be_waited_for_and_none_beyond_it() {
    let mut server = Server::start().await;
    let id = server.session(slow()).await;
    server.mark_first_step(&id).await;
    server.play(&id).await;
    server.until_marked_step(&id).await;
    let answer = server.client.step_session(until_step(&id, 1)).await.expect("it is taken").into_inner();
    let session = answer.session.expect("the answer has the session");
    assert!(session.step >= 1 && session.state() == SessionState::Playing, "{session:?}");

    let refused = server.client.step_session(until_step(&id, 100_000)).await.expect_err("it plays");
    assert_reason(&refused, Reason::SessionPlaying);
    server.pause(&id).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_step_within_those_that_another_call_asked_for_is_answered_when_it_is_taken() {
    const ALL: u64 = 5_000_000;
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    let all = v1::StepSessionRequest { step_count: ALL, ..v1::StepSessionRequest::of(&id) };
    server.client.step_session(all).await.expect("accepted");

    // On a busy machine, a call may come later than the step that it names.
    let mut ahead = 1000;
    loop {
        let to_step = server.get(&id).await.step + ahead;
        let frame = Some(v1::FrameRequest::default());
        let request = v1::StepSessionRequest { frame, ..until_step(&id, to_step) };
        match server.client.step_session(request).await {
            Ok(answer) => {
                let v1::StepSessionResponse { session, frame } = answer.into_inner();
                let session = session.expect("the answer has the session");
                assert_eq!(session.state(), SessionState::Playing, "others are asked for");
                assert_eq!(frame.expect("it was asked for").step, session.step);
                if session.step == to_step {
                    break;
                }
                assert!(session.step > to_step);
            }
            // The state passed before its frame was asked for.
            Err(status) => drop(assert_reason(&status, Reason::StepsInterrupted)),
        }
        ahead *= 4;
        assert!(ahead < ALL / 4, "none of the steps was answered when it was taken");
    }
    server.pause(&id).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn steps_beyond_the_end_of_a_session_give_the_frame_at_its_end() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(4, "steps = 5")).await;
    let frame = Some(v1::FrameRequest::default());
    let request =
        v1::StepSessionRequest { step_count: 9, wait: true, frame, ..v1::StepSessionRequest::of(&id) };
    let answer = server.client.step_session(request).await.expect("it comes to its end").into_inner();
    let session = answer.session.expect("the answer has the session");
    assert_eq!((session.state(), session.step), (SessionState::Finished, 5));
    assert_eq!(answer.frame.expect("it was asked for").step, 5);
}

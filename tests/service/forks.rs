//! A fork stands where its original stands, to the bit, and from there on they are two sessions.

use nappe_proto::v1::{self, SessionState};
use nappe_server::{Limits, Reason};

use crate::{
    cloth_scenes::{sheet, sheet_with},
    harness::{Server, assert_reason, every},
    snow_scenes::{ball, snow},
};

async fn fork(server: &mut Server, id: &str, new_id: &str) -> v1::Session {
    let request = v1::ForkSessionRequest { new_session_id: new_id.into(), ..v1::ForkSessionRequest::of(id) };
    let forked = server.client.fork_session(request).await.expect("forked").into_inner();
    forked.session.expect("the answer has the session")
}

fn wind(id: &str, at_step: u64, x: f64) -> v1::UpdateParametersRequest {
    v1::UpdateParametersRequest {
        at_step,
        wind: Some([x, 0.0, 0.0].into()),
        drag: Some(0.01),
        ..v1::UpdateParametersRequest::of(id)
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fork_of_cloth_or_snow_goes_on_with_the_same_bits() {
    let mut server = Server::start().await;
    for (scene, fork_id) in
        [(sheet(8), "of-cloth"), (snow(""), "of-snow"), (sheet_with(5, "") + &ball(""), "of-both")]
    {
        let id = server.session(scene).await;
        let pin = v1::PinUpdate { particle: 0, target: Some([0.0, 0.1, 0.1].into()), duration_seconds: 0.2 };
        if fork_id == "of-cloth" {
            // A pin on its way and a change that waits, both across the fork.
            let pins =
                v1::UpdateParametersRequest { pins: vec![pin], ..v1::UpdateParametersRequest::of(&id) };
            server.client.update_parameters(pins).await.expect("accepted");
            server.client.update_parameters(wind(&id, 60, 2.0)).await.expect("accepted");
        }
        let original = server.step(&id, 37).await;

        let forked = fork(&mut server, &id, fork_id).await;
        assert_eq!(forked.session_id, fork_id);
        assert_eq!((forked.state(), forked.step, forked.frame), (SessionState::Paused, 37, 0));
        assert_eq!((forked.time_seconds, forked.state_hash), (original.time_seconds, original.state_hash));
        assert_eq!(forked.parameters, original.parameters);
        assert_eq!(forked.particle_count, original.particle_count);
        assert_ne!(forked.uid, original.uid);

        let (original, forked) = (server.step(&id, 100).await, server.step(fork_id, 100).await);
        assert_eq!((forked.step, forked.state_hash), (137, original.state_hash), "{fork_id}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fork_and_its_original_are_two_sessions() {
    let mut server = Server::start().await;
    let id = server.session(sheet(6)).await;
    server.step(&id, 20).await;
    fork(&mut server, &id, "calm").await;
    fork(&mut server, &id, "same").await;

    // The frames of a fork begin with the state that it was made with.
    let mut watch = server.watch(every("calm", 0)).await;
    let first = watch.frame().await;
    assert_eq!((first.head.frame, first.head.step), (0, 20));

    server.client.update_parameters(wind("calm", 0, 5.0)).await.expect("accepted");
    let (original, calm) = (server.step(&id, 30).await, server.step("calm", 30).await);
    assert_ne!(original.state_hash, calm.state_hash, "the wind blows in the fork alone");
    assert_eq!(watch.frame().await.head.step, 21);

    server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("deleted");
    assert_eq!(server.step("same", 30).await.state_hash, original.state_hash, "a fork outlives its original");

    // A session that plays is copied between two of its steps, and plays on.
    server.play("calm").await;
    let copy = fork(&mut server, "calm", "").await;
    assert!(copy.step >= 50 && copy.state() == SessionState::Paused);
    assert_eq!(server.get("calm").await.state(), SessionState::Playing);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fork_of_a_session_at_its_end_goes_on() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(4, "steps = 10")).await;
    server.step(&id, 10).await;
    let forked = fork(&mut server, &id, "further").await;
    assert_eq!((forked.step, forked.step_limit), (10, 0));
    assert_eq!(server.step("further", 5).await.step, 15);

    let to_twelve = v1::ForkSessionRequest { step_limit: Some(12), ..v1::ForkSessionRequest::of(&id) };
    let forked = server.client.fork_session(to_twelve).await.expect("forked").into_inner().session;
    let forked = forked.expect("the session").session_id;
    let request =
        v1::StepSessionRequest { to_step: Some(12), wait: true, ..v1::StepSessionRequest::of(&forked) };
    server.client.step_session(request).await.expect("stepped");
    assert_eq!(server.get(&forked).await.state(), SessionState::Finished);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fork_that_is_not_possible_is_refused() {
    let mut server = Server::with(Limits { max_sessions: 2, ..Limits::default() }).await;
    let id = server.session(sheet(4)).await;
    let to = |new_id: &str| v1::ForkSessionRequest {
        new_session_id: new_id.into(),
        ..v1::ForkSessionRequest::of(&id)
    };
    let refused = server.client.fork_session(to(&id)).await.expect_err("its own id");
    assert_reason(&refused, Reason::SessionExists);
    let refused = server.client.fork_session(to("no id")).await.expect_err("no id");
    assert_eq!(assert_reason(&refused, Reason::InvalidField)["field"], "new_session_id");
    let other = v1::ForkSessionRequest { session_uid: "other".into(), ..to("fork") };
    let refused = server.client.fork_session(other).await.expect_err("another session");
    assert_reason(&refused, Reason::SessionReplaced);

    server.client.fork_session(to("fork")).await.expect("forked");
    let refused = server.client.fork_session(to("one-more")).await.expect_err("too many");
    assert_reason(&refused, Reason::TooManySessions);

    server.play("fork").await;
    assert!(server.app.inject_panic("fork"));
    server.until("fork", |session| session.state() == SessionState::Failed).await;
    let refused =
        server.client.fork_session(v1::ForkSessionRequest::of("fork")).await.expect_err("it failed");
    assert_reason(&refused, Reason::TooManySessions);
    server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("deleted");
    let refused =
        server.client.fork_session(v1::ForkSessionRequest::of("fork")).await.expect_err("it failed");
    assert_reason(&refused, Reason::SessionFailed);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fork_counts_against_the_memory_of_the_server() {
    let (history_bytes_per_session, max_server_bytes) = (1 << 30, 3 << 29);
    let limits = Limits { history_bytes_per_session, max_server_bytes, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let id = server.session(sheet(4)).await;
    let fork = v1::ForkSessionRequest::of(&id);
    let refused = server.client.fork_session(fork).await.expect_err("room for one");
    assert_reason(&refused, Reason::ServerMemoryFull);

    // What was refused took nothing: there is room for one again.
    server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("deleted");
    let id = server.session(sheet(4)).await;
    assert_eq!(server.step(&id, 2).await.step, 2);
}

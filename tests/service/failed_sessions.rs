//! A session that panics or diverges fails with its reason, and other sessions go on.

use nappe_proto::v1::{self, SessionState};
use nappe_server::Reason;

use crate::{
    cloth_scenes::sheet,
    frames::Watch,
    harness::{Server, assert_reason, every, latest},
};

/// Explicit Euler far beyond its largest step: it diverges within a few hundred steps.
pub(crate) fn diverging() -> String {
    sheet(5)
        .replace("dt = 0.002", "dt = 0.5")
        .replace("drag = 1e-4", "integrator = \"explicit_euler\"\nunchecked = true")
}

/// Reads frames of a watcher until `count` more came, and checks that none is missing.
async fn without_a_gap(watch: &mut Watch, next: &mut u64, count: u64) {
    for _ in 0..count {
        assert_eq!(watch.frame().await.head.frame, *next);
        *next += 1;
    }
}

async fn assert_failed(server: &mut Server, id: &str, reason: Reason) -> v1::Failure {
    let session = server.until(id, |session| session.state() == SessionState::Failed).await;
    let failure = session.failure.expect("a failed session says why");
    assert_eq!(failure.reason, reason.name());
    assert!(!failure.message.is_empty());
    let play = v1::PlaySessionRequest { real_time_factor: 0.0, ..v1::PlaySessionRequest::of(id) };
    let status = server.client.play_session(play).await.expect_err("it failed");
    assert_eq!(assert_reason(&status, Reason::SessionFailed)["failure"], reason.name());
    failure
}

#[tokio::test(flavor = "multi_thread")]
async fn a_panic_in_one_session_leaves_the_others_alone() {
    let mut server = Server::start().await;
    let (bad, good) = (server.session(sheet(5)).await, server.session(sheet(5)).await);
    let mut watchers = [server.watch(every(&bad, 0)).await, server.watch(latest(&bad)).await];
    let mut other = server.watch(every(&good, 0)).await;

    let mut next = 0;
    server.play_in_real_time(&good).await;
    without_a_gap(&mut other, &mut next, 50).await;

    server.play_in_real_time(&bad).await;
    server.until(&bad, |session| session.step > 10).await;
    assert!(server.app.inject_panic(&bad));

    for watch in &mut watchers {
        let (frames, status) = watch.until_break().await;
        let metadata = assert_reason(&status, Reason::SessionPanicked);
        assert!(status.message().contains("injected"), "{}", status.message());
        let last = frames.last().expect("frames before the panic").head.step;
        assert_eq!(metadata["step"], last.to_string(), "the frames before it all arrived");
    }

    let failure = assert_failed(&mut server, &bad, Reason::SessionPanicked).await;
    assert!(failure.step > 10);
    without_a_gap(&mut other, &mut next, 50).await;

    // A late watcher is told the same, and the session can be deleted.
    let (_, status) = server.watch(latest(&bad)).await.until_break().await;
    assert_reason(&status, Reason::SessionPanicked);
    server.client.delete_session(v1::DeleteSessionRequest::of(bad)).await.expect("deleted");
    without_a_gap(&mut other, &mut next, 50).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_divergence_names_step_particle_and_value_and_keeps_the_last_good_frame() {
    let mut server = Server::start().await;
    let (bad, good) = (server.session(diverging()).await, server.session(sheet(5)).await);
    let mut other = server.watch(every(&good, 0)).await;
    let mut watch = server.watch(every(&bad, 0)).await;
    let mut next = 0;
    server.play_in_real_time(&good).await;
    let step = v1::StepSessionRequest { step_count: 100_000, wait: true, ..v1::StepSessionRequest::of(&bad) };
    let status = server.client.step_session(step).await.expect_err("it diverges");
    let metadata = assert_reason(&status, Reason::NotFinite);
    let failure = assert_failed(&mut server, &bad, Reason::NotFinite).await;
    assert_eq!(metadata["step"], failure.step.to_string());
    assert_eq!(metadata["particle"], failure.particle.expect("the particle").to_string());
    assert!(failure.particle.is_some_and(|particle| particle < 25));
    assert!(metadata.contains_key("value") && failure.value.is_some_and(|value| !value.is_finite()));

    let (frames, status) = watch.until_break().await;
    assert_eq!(assert_reason(&status, Reason::NotFinite), metadata);
    for frame in &frames {
        let x = frame.numbers(v1::Field::Positions, f32::from_le_bytes);
        assert!(x.iter().all(|c| c.is_finite()), "frame {}", frame.head.frame);
    }

    // The state before the step that failed is the last frame.
    assert_eq!(frames.last().expect("frames").head.step, failure.step);
    without_a_gap(&mut other, &mut next, 100).await;
}

//! Streams carry what happens to a session, in order with its frames, so that nobody polls.

use nappe_client::{Client as Library, DiagnosticsEvent};
use nappe_proto::v1::{self, ChangeKind, SessionState};
use nappe_server::Reason;

use crate::{
    cloth_scenes::{sheet, sheet_with},
    frames::{Next, Watch, in_time},
    harness::{Server, assert_reason, every, latest},
};

/// Kind, state, steps before and newest frame of each change.
fn told(watch: &Watch) -> Vec<(ChangeKind, SessionState, u64, u64)> {
    let told = |change: &v1::StateChange| (change.kind(), change.state(), change.step, change.frame);
    watch.changes.iter().map(told).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_is_told_of_every_state_at_its_place_among_the_frames() {
    use ChangeKind::{Parameters, Present, State};
    use SessionState::{Finished, Paused, Playing};
    let mut server = Server::start().await;
    let id = server.session(sheet_with(4, "steps = 10\nframe_interval = 2")).await;
    let mut watch = server.watch(every(&id, 0)).await;

    server.step(&id, 5).await;
    let wind = v1::UpdateParametersRequest {
        at_step: 7,
        wind: Some([1.0, 0.0, 0.0].into()),
        ..v1::UpdateParametersRequest::of(&id)
    };
    server.client.update_parameters(wind).await.expect("accepted");
    server.step(&id, 5).await;

    let (frames, _) = watch.until_end().await;
    assert_eq!(frames.len(), 6);
    let expected = [
        (Present, Paused, 0, 0),
        (State, Playing, 0, 0),
        (State, Paused, 5, 2),
        (State, Playing, 5, 2),
        (Parameters, Playing, 7, 3),
        (State, Finished, 10, 5),
    ];
    assert_eq!(told(&watch), expected);
    let numbers: Vec<u64> = watch.changes.iter().map(|change| change.number).collect();
    assert_eq!(numbers, [0, 1, 2, 3, 4, 5]);
    let uid = server.get(&id).await.uid;
    assert!(watch.changes.iter().all(|change| change.session_uid == uid));

    // Whoever comes later is told how it stands.
    let mut late = server.watch(latest(&id)).await;
    late.until_end().await;
    assert_eq!(told(&late), [(Present, Finished, 10, 5)]);
    assert_eq!(late.changes[0].number, 5);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_failure_comes_with_its_reason_before_the_stream_breaks() {
    let mut server = Server::start().await;
    let id = server.session(sheet(5)).await;
    let (mut a, mut b) = (server.watch(every(&id, 0)).await, server.watch(latest(&id)).await);
    server.play_in_real_time(&id).await;
    server.until(&id, |session| session.step > 5).await;
    assert!(server.app.inject_panic(&id));
    for watch in [&mut a, &mut b] {
        let (frames, status) = watch.until_break().await;
        assert_reason(&status, Reason::SessionPanicked);
        let last = watch.changes.last().expect("a change");
        assert_eq!((last.kind(), last.state()), (ChangeKind::State, SessionState::Failed));
        let failure = last.failure.as_ref().expect("why it failed");
        assert_eq!(failure.reason, Reason::SessionPanicked.name());
        assert_eq!(last.frame, frames.last().expect("frames").head.frame);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_makes_results_doubtful_is_told_once_and_counted_in_diagnostics() {
    let mut server = Server::start().await;
    let scene = sheet_with(6, "steps = 8") + "\n[body.solver]\ntolerance = 1e-12\nmax_iterations = 2\n";
    let id = server.session(scene).await;
    let mut watch = server.watch(every(&id, 0)).await;
    server.play(&id).await;
    watch.until_end().await;

    let told: Vec<_> = watch.changes.iter().filter(|change| !change.notice.is_empty()).collect();
    let [first] = told[..] else { panic!("{told:?}") };
    assert_eq!((first.kind(), first.step), (ChangeKind::Notice, 1));
    assert!(first.notice.contains("max_iterations"), "{}", first.notice);
    let notices = server.get(&id).await.diagnostics.expect("diagnostics").notices.expect("notices");
    assert_eq!((notices.capped_solves, notices.indefinite_solves, notices.passed_particles), (8, 0, 0));

    // Whoever comes later reads the counts, not the notice.
    let mut late = server.watch(latest(&id)).await;
    late.until_end().await;
    assert!(late.changes.iter().all(|change| change.notice.is_empty()));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_deletion_and_a_shutdown_are_told_before_the_stream_breaks() {
    let mut server = Server::start().await;
    let (gone, other) = (server.session(sheet(4)).await, server.session(sheet(4)).await);
    let (mut a, mut b) = (server.watch(every(&gone, 0)).await, server.watch(latest(&gone)).await);
    let (mut c, mut d) = (server.watch(every(&other, 0)).await, server.watch(latest(&other)).await);
    for watch in [&mut a, &mut b, &mut c, &mut d] {
        watch.frame().await;
    }

    server.client.delete_session(v1::DeleteSessionRequest::of(&gone)).await.expect("deleted");
    for watch in [a, b] {
        assert_end(watch, ChangeKind::Deleted, Reason::SessionDeleted).await;
    }
    in_time(server.app.shutdown()).await;
    for watch in [c, d] {
        assert_end(watch, ChangeKind::Draining, Reason::ServerDraining).await;
    }
}

async fn assert_end(mut watch: Watch, kind: ChangeKind, reason: Reason) {
    let (_, status) = watch.until_break().await;
    assert_reason(&status, reason);
    assert_eq!(watch.changes.last().expect("a change").kind(), kind);
    assert!(matches!(watch.next().await, Next::Closed), "nothing follows the status");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_of_diagnostics_is_told_the_same() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(4, "steps = 6\nframe_interval = 2")).await;
    let library = Library::connect(&server.app.url()).await.expect("connected");
    let mut stream = library.watch_diagnostics(&id, 0.0).await.expect("a stream");
    server.play(&id).await;

    let mut told = Vec::new();
    while let Some(event) = in_time(stream.next_event()).await {
        told.push(match event.expect("no error") {
            DiagnosticsEvent::Change(change) => format!("{:?} at {}", change.state(), change.step),
            DiagnosticsEvent::Diagnostics(diagnostics) => format!("step {}", diagnostics.step),
            DiagnosticsEvent::End(end) => format!("end at {}", end.step),
            other => panic!("not expected: {other:?}"),
        });
    }
    let expected =
        ["Paused at 0", "step 0", "Playing at 0", "step 2", "step 4", "step 6", "Finished at 6", "end at 6"];
    assert_eq!(told, expected);
}

#[tokio::test(flavor = "multi_thread")]
async fn every_sub_step_that_is_taken_again_is_told_and_counted() {
    let mut server = Server::start().await;
    let scene = sheet_with(6, "steps = 8").replace("drag = 1e-4", "drag = 1e-4\ntolerance = 1e-6");
    let id = server.session(scene).await;
    let mut watch = server.watch(every(&id, 0)).await;
    server.play(&id).await;
    watch.until_end().await;

    let rejected: Vec<_> =
        watch.changes.iter().filter(|change| change.kind() == ChangeKind::Rejected).collect();
    let first =
        rejected.first().and_then(|change| change.rejected.clone()).expect("the first step is too long");
    assert_eq!((first.time_seconds, first.dt_seconds, first.body.as_str()), (0.0, 0.002, "sheet"));
    assert_eq!(first.reason, Reason::ErrorTolerance.name());
    assert!(first.particle.is_some() && first.value > Some(1e-6), "{first:?}");
    assert!(first.message.contains("more than the tolerance of 1.0000e-6 m"), "{}", first.message);

    let diagnostics = server.get(&id).await.diagnostics.expect("diagnostics");
    assert_eq!(diagnostics.notices.map(|notices| notices.rejected_steps), Some(rejected.len() as u64));
    let cloth = diagnostics.cloth.expect("a cloth");
    assert!(cloth.substeps > 1 && cloth.error_largest <= 1e-6 && cloth.error_rms > 0.0, "{cloth:?}");
    assert_eq!(cloth.bound(), v1::TimeBound::Tolerance);
}

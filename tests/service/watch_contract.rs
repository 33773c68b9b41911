//! What every stream promises, in etcd's six words: ordered, unique, reliable, resumable, bookmarkable, atomic.
//! A journal checks each message of real streams while a session is played, paused, stepped and changed at random,
//! and its readers are fast, slow, or leave and come back.

use std::time::Duration;

use nappe_proto::v1::{
    self, watch_diagnostics_response::Event as DiagnosticsEvent, watch_frames_response::Event,
};
use nappe_server::{Limits, Reason};
use tokio::task::JoinSet;
use tokio_stream::StreamExt as _;
use tonic::Status;
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::{dust, sheet},
    frames::in_time,
    harness::{Client, Server, assert_reason, connect, every, latest},
    watch_journal::{Journal, Told},
};

/// A reader: how it watches, and what it does to itself.
#[derive(Clone, Copy, Debug)]
struct Habit {
    is_diagnostics: bool,
    delivery: v1::Delivery,
    max_rate_hz: f64,
    /// Longest pause between two messages (ms).
    pause_ms: u64,
    /// One message in so many makes it leave and come back; 0: never.
    leaves: u64,
}

/// Watches until the end of the session, coming back whenever it left or was told that it is too slow.
async fn follow(mut client: Client, id: String, habit: Habit, seed: u64) -> Journal {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut journal = Journal::new(habit.delivery);
    while journal.end.is_none() {
        let from_frame = journal.is_every.then(|| journal.last.map_or(0, |last| last + 1));
        let (delivery, max_rate_hz) = (habit.delivery.into(), habit.max_rate_hz);
        if habit.is_diagnostics {
            let request = v1::WatchDiagnosticsRequest {
                delivery,
                max_rate_hz,
                from_frame,
                ..v1::WatchDiagnosticsRequest::of(&id)
            };
            let opened = client.watch_diagnostics(request).await.expect("a stream").into_inner();
            read(opened.map(|message| message.map(Told::from)), &mut journal, habit, &mut random).await;
        } else {
            let request = v1::WatchFramesRequest {
                delivery,
                max_rate_hz,
                from_frame,
                ..v1::WatchFramesRequest::of(&id)
            };
            let opened = client.watch_frames(request).await.expect("a stream").into_inner();
            read(opened.map(|message| message.map(Told::from)), &mut journal, habit, &mut random).await;
        }
        journal.broke();
    }
    journal
}

/// Reads one stream until it ends or the reader leaves.
async fn read(
    mut messages: impl tokio_stream::Stream<Item = Result<Told, Status>> + Unpin,
    journal: &mut Journal,
    habit: Habit,
    random: &mut fastrand::Rng,
) {
    loop {
        let message = in_time(messages.next()).await;
        match message {
            None => return assert!(journal.end.is_some(), "a stream ends with the session's end"),
            Some(message) => journal.read(message.expect("the history keeps all frames")),
        }
        if habit.leaves > 0 && random.u64(0..habit.leaves) == 0 {
            return;
        }
        if habit.pause_ms > 0 {
            tokio::time::sleep(Duration::from_millis(random.u64(0..habit.pause_ms))).await;
        }
    }
}

/// Plays, pauses, steps and changes a session at random, then stops it.
async fn control(mut client: Client, id: &str, seed: u64) {
    let mut random = fastrand::Rng::with_seed(seed);
    for _ in 0..60 {
        match random.u32(0..4) {
            0 => {
                let request =
                    v1::PlaySessionRequest { real_time_factor: 0.2, ..v1::PlaySessionRequest::of(id) };
                drop(client.play_session(request).await.expect("it plays"));
            }
            1 => drop(client.pause_session(v1::PauseSessionRequest::of(id)).await.expect("it pauses")),
            2 => {
                let request = v1::StepSessionRequest {
                    step_count: random.u64(1..9),
                    wait: false,
                    ..v1::StepSessionRequest::of(id)
                };
                // Refused while it plays.
                drop(client.step_session(request).await);
            }
            _ => {
                let wind = [random.f64(), 0.0, 0.0];
                let request = v1::UpdateParametersRequest {
                    wind: Some(wind.into()),
                    ..v1::UpdateParametersRequest::of(id)
                };
                drop(client.update_parameters(request).await.expect("accepted"));
            }
        }
        tokio::time::sleep(Duration::from_millis(random.u64(0..25))).await;
    }
    // Some frames, however little was stepped so far.
    client.pause_session(v1::PauseSessionRequest::of(id)).await.expect("it pauses");
    let steps = v1::StepSessionRequest { step_count: 20, wait: true, ..v1::StepSessionRequest::of(id) };
    client.step_session(steps).await.expect("the steps are taken");
    client.stop_session(v1::StopSessionRequest::of(id)).await.expect("it stops");
}

const EVERY: v1::Delivery = v1::Delivery::Every;
const LATEST: v1::Delivery = v1::Delivery::Latest;

/// One of each: fast, slow, rare, and not faithful.
fn habits() -> Vec<Habit> {
    let fast = Habit { is_diagnostics: false, delivery: EVERY, max_rate_hz: 0.0, pause_ms: 0, leaves: 0 };
    let slow = Habit { pause_ms: 10, ..fast };
    let fickle = Habit { leaves: 20, ..fast };
    let of_frames = [
        fast,
        slow,
        fickle,
        Habit { delivery: LATEST, ..fast },
        Habit { delivery: LATEST, pause_ms: 30, ..fast },
        Habit { delivery: LATEST, max_rate_hz: 20.0, ..fast },
        Habit { delivery: LATEST, ..fickle },
    ];
    let of_diagnostics = of_frames.map(|habit| Habit { is_diagnostics: true, ..habit });
    [of_frames, of_diagnostics].concat()
}

/// Follows a session of a scene with every habit while it is controlled at random.
async fn check(scene: String, seed: u64) -> Vec<(Habit, Journal)> {
    let mut server = Server::with(Limits { history_bytes_per_session: 4 << 30, ..Limits::default() }).await;
    let id = server.session(scene).await;
    let mut readers = Vec::new();
    for (reader, habit) in habits().into_iter().enumerate() {
        let client = connect(&server.app).await;
        let follow = tokio::spawn(follow(client, id.clone(), habit, seed + reader as u64));
        readers.push((habit, follow));
    }
    server.until(&id, |session| session.watcher_count as usize == readers.len()).await;
    control(server.client.clone(), &id, seed).await;

    let mut journals = Vec::new();
    for (habit, follow) in readers {
        journals.push((habit, in_time(follow).await.unwrap_or_else(|_| panic!("seed {seed}, {habit:?}"))));
    }
    journals
}

#[tokio::test(flavor = "multi_thread")]
async fn streams_keep_their_six_promises_whatever_is_done_to_session_and_readers() {
    // Frames of one piece and of three.
    for (seed, scene) in [(1, sheet(5)), (2, sheet(5)), (3, dust(450, "frame_interval = 2"))] {
        let journals = check(scene, 1000 * seed).await;
        let end = journals[0].1.end.expect("it ended");
        let all = &journals[0].1.changes;
        assert!(all.len() > 10 && end.frame > 5, "seed {seed}: {} changes, {end:?}", all.len());
        for (habit, journal) in &journals {
            let context = format!("seed {seed}, {habit:?}");
            assert_eq!(journal.end, Some(end), "{context}");
            if habit.delivery == EVERY {
                assert_eq!(journal.frame_count, end.frame + 1, "{context}: each frame once");
            }
            // Whoever stayed has all changes; whoever left missed those of his absence.
            let is_one_of_all = |change: &&v1::StateChange| all.contains(change);
            assert_eq!(
                journal.changes.iter().filter(is_one_of_all).count(),
                journal.changes.len(),
                "{context}"
            );
            assert!(habit.leaves > 0 || journal.changes == *all, "{context}");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_without_frames_gets_bookmarks_from_which_it_can_resume() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    server.step(&id, 3).await;
    let diagnostics = v1::WatchDiagnosticsRequest {
        delivery: EVERY.into(),
        from_frame: Some(100),
        ..v1::WatchDiagnosticsRequest::of(&id)
    };
    let mut waiting = server.client.watch_diagnostics(diagnostics).await.expect("a stream").into_inner();
    let rare = v1::WatchFramesRequest { max_rate_hz: 1e-3, ..latest(&id) };
    let mut watchers = JoinSet::new();
    for request in [every(&id, 0), latest(&id), rare] {
        let mut stream = server.client.watch_frames(request).await.expect("a stream").into_inner();
        watchers.spawn(async move {
            loop {
                let message = in_time(stream.next()).await;
                if let Some(Event::Progress(progress)) = message.expect("no end").expect("no error").event {
                    return progress;
                }
            }
        });
    }
    for progress in watchers.join_all().await {
        assert_eq!((progress.frame, progress.step), (3, 3));
    }
    let progress = loop {
        match in_time(waiting.next()).await.expect("no end").expect("no error").event {
            Some(DiagnosticsEvent::Progress(progress)) => break progress,
            Some(DiagnosticsEvent::Change(_)) => {}
            other => panic!("not expected: {other:?}"),
        }
    };
    assert_eq!(progress.frame, 3, "who waits for a frame is told how far the session is");

    let mut resumed = server.watch(every(&id, progress.frame + 1)).await;
    server.step(&id, 1).await;
    assert_eq!(resumed.frame().await.head.frame, 4);
}

#[tokio::test(flavor = "multi_thread")]
async fn diagnostics_resume_where_they_were_left_or_say_what_is_gone() {
    let mut server = Server::with(Limits { history_bytes_per_session: 20_000, ..Limits::default() }).await;
    let id = server.session(sheet(4)).await;
    server.step(&id, 30).await;
    let oldest = server.get(&id).await.oldest_frame;
    let from = |from_frame| v1::WatchDiagnosticsRequest {
        delivery: EVERY.into(),
        from_frame: Some(from_frame),
        ..v1::WatchDiagnosticsRequest::of(&id)
    };
    let refused = server.client.watch_diagnostics(from(oldest - 1)).await.expect_err("no longer kept");
    assert_eq!(assert_reason(&refused, Reason::FrameExpired)["oldest_frame"], oldest.to_string());
    let misplaced = v1::WatchDiagnosticsRequest { delivery: LATEST.into(), ..from(oldest) };
    let refused = server.client.watch_diagnostics(misplaced).await.expect_err("it goes with EVERY");
    assert_eq!(refused.get_details_error_info().expect("a reason").metadata["field"], "from_frame");

    server.client.stop_session(v1::StopSessionRequest::of(&id)).await.expect("stopped");
    let mut journal = Journal::new(EVERY);
    journal.last = Some(oldest - 1);
    let mut stream = server.client.watch_diagnostics(from(oldest)).await.expect("kept").into_inner();
    while let Some(message) = in_time(stream.next()).await {
        journal.read(message.expect("no error").into());
    }
    assert_eq!(journal.end.map(|end| end.frame), Some(30));
    assert_eq!(journal.frame_count, 31 - oldest);
}

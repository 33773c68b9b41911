//! A watcher that comes back gets the frames that it missed, or is told which are gone.

use nappe_proto::v1::{self, Field};
use nappe_server::{Limits, Reason};

use crate::{
    cloth_scenes::{dust, sheet, sheet_with},
    harness::{Server, assert_reason, every},
};

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_resumes_without_a_gap_or_a_repeat() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(5, "steps = 60")).await;
    let mut whole = server.watch(every(&id, 0)).await;
    let mut first = server.watch(every(&id, 0)).await;
    server.play(&id).await;
    let mut pieced = Vec::new();
    for _ in 0..20 {
        pieced.push(first.frame().await);
    }

    // The connection breaks; the watcher comes back with the number after the last it saw.
    drop(first);
    let resume_at = pieced.last().expect("a frame").head.frame + 1;
    let (rest, _) = server.watch(every(&id, resume_at)).await.until_end().await;
    pieced.extend(rest);
    let (all, _) = whole.until_end().await;
    assert_eq!(pieced.len(), all.len());
    for (a, b) in pieced.iter().zip(&all) {
        assert_eq!((a.head.frame, &a.fields), (b.head.frame, &b.fields));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frame_that_is_no_longer_kept_is_refused_with_the_oldest_that_is() {
    // 16 particles: 192 bytes of positions per frame, and some 1 000 of diagnostics and bookkeeping.
    let mut server = Server::with(Limits { history_bytes_per_session: 20_000, ..Limits::default() }).await;
    let id = server.session(sheet(4)).await;
    server.step(&id, 30).await;
    let session = server.get(&id).await;
    let oldest = session.oldest_frame;
    assert!(session.frame == 30 && (10..=22).contains(&oldest), "frames {oldest} to {}", session.frame);
    let refused = server.client.watch_frames(every(&id, oldest - 1)).await.expect_err("dropped");
    let metadata = assert_reason(&refused, Reason::FrameExpired);
    assert_eq!((&metadata["oldest_frame"], metadata["newest_frame"].as_str()), (&oldest.to_string(), "30"));
    let mut watch = server.watch(every(&id, oldest)).await;
    for number in oldest..=30 {
        assert_eq!(watch.frame().await.head.frame, number);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_history_smaller_than_a_frame_keeps_the_newest() {
    let mut server = Server::with(Limits { history_bytes_per_session: 0, ..Limits::default() }).await;
    let id = server.session(sheet(4)).await;
    server.step(&id, 3).await;
    let mut watch = server.watch(every(&id, 3)).await;
    assert_eq!(watch.frame().await.numbers(Field::Positions, f32::from_le_bytes).len(), 48);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frame_that_is_not_made_yet_can_be_waited_for() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(4, "steps = 20")).await;
    let mut next = server.watch(every(&id, 1)).await;
    let mut far = server.watch(every(&id, 7)).await;
    let mut beyond = server.watch(every(&id, 22)).await;
    server.step(&id, 8).await;
    for number in 1..=8 {
        assert_eq!(next.frame().await.head.frame, number);
    }
    for number in 7..=8 {
        assert_eq!(far.frame().await.head.frame, number);
    }

    // Without a number, every frame from the newest on.
    let newest = v1::WatchFramesRequest { from_frame: None, ..every(&id, 0) };
    assert_eq!(server.watch(newest).await.frame().await.head.frame, 8);

    // A frame beyond the end is never made, and whoever waits for it is told.
    let mut after_the_last = server.watch(every(&id, 21)).await;
    server.step(&id, 12).await;
    let (frames, end) = after_the_last.until_end().await;
    assert!(frames.is_empty() && end.frame == 20, "who has every frame gets the end");
    let (frames, status) = beyond.until_break().await;
    assert_eq!((frames.len(), &*assert_reason(&status, Reason::FrameNotMade)["newest_frame"]), (0, "20"));
    let refused = server.client.watch_frames(every(&id, 22)).await.expect_err("never made");
    assert_reason(&refused, Reason::FrameNotMade);
    assert!(server.watch(every(&id, 21)).await.until_end().await.0.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_of_every_frame_that_stalls_is_told_that_it_is_too_slow() {
    // A frame is 480 kB: the history keeps two, and what HTTP/2 buffers holds a few more.
    let mut server = Server::with(Limits { history_bytes_per_session: 1 << 20, ..Limits::default() }).await;
    let id = server.session(dust(200, "")).await;
    let mut watch = server.watch(every(&id, 0)).await;
    server.step(&id, 40).await;
    let (frames, status) = watch.until_break().await;
    let metadata = assert_reason(&status, Reason::WatcherTooSlow);
    let numbers: Vec<u64> = frames.iter().map(|frame| frame.head.frame).collect();
    assert_eq!(numbers, (0..numbers.len() as u64).collect::<Vec<_>>(), "what came has no gap");
    assert_eq!(metadata["next_frame"], numbers.len().to_string(), "the first that did not come");
    let oldest: u64 = metadata["oldest_frame"].parse().expect("a number");
    assert!(oldest > numbers.len() as u64);
}

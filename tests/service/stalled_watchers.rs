//! Watchers that do not read neither hold the session up nor cost other watchers a frame.

use std::time::{Duration, Instant};

use nappe_proto::v1;
use nappe_server::{Config, Limits, Reason};
use tokio_stream::StreamExt as _;
use tonic::{Status, Streaming};
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::dust,
    harness::{Server, assert_reason, connect, every, latest},
};

const WATCHERS: usize = 20;
const STEPS: u64 = 80;

/// Opens a stream on a connection of its own, and reads nothing of it.
async fn stalled(server: &Server, request: v1::WatchFramesRequest) -> Streaming<v1::WatchFramesResponse> {
    let mut client = connect(&server.app).await;
    client.watch_frames(request).await.expect("the stream opens").into_inner()
}

#[tokio::test(flavor = "multi_thread")]
async fn twenty_stalled_watchers_do_not_hold_a_session_up() {
    // A frame is 480 kB, so that what HTTP/2 buffers is full after a few.
    let limits = Limits { history_bytes_per_session: 8 << 20, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let alone = server.session(dust(200, "")).await;

    let begin = Instant::now();
    let alone = server.step(&alone, STEPS).await;
    let time_alone = begin.elapsed();

    let id = server.session(dust(200, "")).await;
    let mut streams = Vec::new();
    for i in 0..WATCHERS {
        let request = if i % 2 == 0 { every(&id, 0) } else { latest(&id) };
        streams.push(stalled(&server, request).await);
    }

    server.until(&id, |session| session.watcher_count == WATCHERS as u32).await;
    let begin = Instant::now();
    let watched = server.step(&id, STEPS).await;
    println!("{STEPS} steps: {time_alone:?} alone, {:?} with {WATCHERS} stalled watchers", begin.elapsed());
    assert_eq!((watched.step, watched.frame), (STEPS, STEPS), "all steps are taken while nobody reads");
    assert_eq!(watched.state_hash, alone.state_hash);
    println!("stepping: {} s alone, {} s watched", alone.stepping_seconds, watched.stepping_seconds);
    assert!(server.get(&id).await.watcher_count >= WATCHERS as u32 / 2, "those of the newest are there");

    // Now they read: whoever wanted every frame is told that it was too slow, the others get the newest.
    for (i, mut stream) in streams.into_iter().enumerate() {
        let mut newest = 0;
        let broken = loop {
            match stream.next().await.expect("no end") {
                Ok(v1::WatchFramesResponse {
                    event: Some(v1::watch_frames_response::Event::Frame(frame)),
                }) => {
                    assert!(frame.frame >= newest);
                    newest = frame.frame;
                    if i % 2 == 1 && newest == STEPS {
                        break None;
                    }
                }
                Ok(_) => {}
                Err(status) => break Some(status),
            }
        };

        match broken {
            Some(status) if i % 2 == 0 => {
                assert_reason(&status, Reason::WatcherTooSlow);
            }
            None => {}
            Some(status) => panic!("a watcher of the newest never breaks: {status:?}"),
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_that_reads_gets_every_frame_beside_stalled_ones() {
    let mut server = Server::start().await;
    let id = server.session(dust(120, "steps = 150")).await;
    let mut streams = Vec::new();
    for _ in 0..WATCHERS {
        streams.push(stalled(&server, every(&id, 0)).await);
    }

    let mut reader = server.watch(every(&id, 0)).await;
    server.play(&id).await;
    let (frames, end) = reader.until_end().await;
    assert_eq!((frames.len(), end.step), (151, 150));
    assert!(frames.iter().enumerate().all(|(i, frame)| frame.head.frame == i as u64));
    assert_eq!(streams.len(), WATCHERS);
}

/// Reads to the end and returns the status that broke the stream.
async fn status(mut stream: Streaming<v1::WatchFramesResponse>) -> Status {
    loop {
        if let Err(status) = stream.next().await.expect("a status comes before the end") {
            return status;
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_that_fetches_nothing_ends_and_its_place_is_free() {
    let limits = Limits { max_watchers_per_session: 4, ..Limits::default() };
    let mut server =
        Server::configured(Config { watcher_stall_seconds: 2.0, limits, ..Config::default() }).await;
    let id = server.session(dust(200, "")).await;
    let mut streams = Vec::new();
    for i in 0..4 {
        let request = if i % 2 == 0 { every(&id, 0) } else { latest(&id) };
        streams.push(stalled(&server, request).await);
    }

    // Frames are kept for all of them, and no more come: they do not read what is there.
    server.step(&id, 30).await;
    server.until(&id, |session| session.watcher_count == 0).await;
    let mut reader = server.watch(every(&id, 30)).await;
    reader.frame().await;
    for stream in streams {
        assert_eq!(assert_reason(&status(stream).await, Reason::WatcherStalled)["seconds"], "2");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_that_leaves_the_messages_of_an_ended_watcher_unread_is_cut() {
    let mut server = Server::configured(Config { watcher_stall_seconds: 0.5, ..Config::default() }).await;
    let id = server.session(dust(200, "")).await;
    let stream = stalled(&server, latest(&id)).await;
    server.step(&id, 30).await;
    server.until(&id, |session| session.watcher_count == 0).await;
    tokio::time::sleep(Duration::from_secs(2)).await;

    let broken = status(stream).await;
    assert!(broken.get_details_error_info().is_none(), "the connection broke before the status: {broken:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_watcher_stalled_longest_gives_way_when_watchers_hold_too_much() {
    // A frame is 480 kB. Sessions keep two of them, and watchers may hold thirteen more: each one or two that are being
    // sent, and one that waits.
    let limits = Limits { history_bytes_per_session: 1 << 20, max_held_bytes: 6 << 20, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let id = server.session(dust(200, "")).await;
    let play = v1::PlaySessionRequest { real_time_factor: 0.1, ..v1::PlaySessionRequest::of(&id) };
    server.client.play_session(play).await.expect("it plays");
    let mut streams = Vec::new();
    for _ in 0..8 {
        let mut stream = stalled(&server, latest(&id)).await;
        // The topology takes room too: what is measured begins after it.
        while !matches!(
            stream.next().await.expect("no end").expect("no error").event,
            Some(v1::watch_frames_response::Event::Frame(_))
        ) {}
        streams.push(stream);
        // Enough frames to fill what HTTP/2 buffers: then it stalls, within a frame that it alone holds.
        tokio::time::sleep(Duration::from_millis(300)).await;
    }

    server.until(&id, |session| session.watcher_count <= 6).await;
    tokio::time::sleep(Duration::from_secs(1)).await;
    let left = server.get(&id).await.watcher_count;
    assert!((4..=6).contains(&left), "{left}: no more give way than have to");
    let first = streams.remove(0);
    assert_eq!(assert_reason(&status(first).await, Reason::WatcherStalled)["allowed"], "6291456");
    let mut last = streams.pop().expect("the last");
    for _ in 0..30 {
        last.next().await.expect("no end").expect("it goes on");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_waits_for_a_watcher_that_asks_for_it() {
    let limits = Limits { history_bytes_per_session: 1 << 20, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let paced = |id: &str| v1::WatchFramesRequest { pace_to_watcher: true, ..every(id, 0) };

    // The session keeps two frames, and would be far ahead.
    let id = server.session(dust(200, "steps = 60")).await;
    let mut reader = server.watch(paced(&id)).await;
    server.play(&id).await;
    for number in 0..=60 {
        assert_eq!(reader.frame().await.head.frame, number);
        tokio::time::sleep(Duration::from_millis(3)).await;
    }
    let unpaced = server.session(dust(200, "steps = 60")).await;
    let slow = stalled(&server, every(&unpaced, 0)).await;
    server.step(&unpaced, 60).await;
    assert_reason(&status(slow).await, Reason::WatcherTooSlow);

    let wrong = v1::WatchFramesRequest { pace_to_watcher: true, ..latest(&id) };
    let refused = server.client.watch_frames(wrong).await.expect_err("it gets the newest only");
    assert_reason(&refused, Reason::InvalidField);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_does_not_wait_for_ever_for_a_watcher_that_stalls() {
    let limits = Limits { history_bytes_per_session: 1 << 20, ..Limits::default() };
    let mut server =
        Server::configured(Config { watcher_stall_seconds: 1.0, limits, ..Config::default() }).await;
    let id = server.session(dust(200, "steps = 60")).await;
    let paced = v1::WatchFramesRequest { pace_to_watcher: true, ..every(&id, 0) };
    let watcher = stalled(&server, paced).await;
    server.play(&id).await;
    server.until(&id, |session| session.watcher_count == 0).await;
    assert_reason(&status(watcher).await, Reason::WatcherStalled);
    server.until(&id, |session| session.state() == v1::SessionState::Finished).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_topology_on_its_way_does_not_make_a_watcher_too_slow() {
    // A frame is 1.9 MB: the session keeps two. The topology is twice as large, and nobody reads it yet.
    let limits = Limits { history_bytes_per_session: 4 << 20, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let id = server.session(dust(400, "")).await;
    let mut stream = stalled(&server, every(&id, 0)).await;
    server.step(&id, 3).await;

    let mut frames = Vec::new();
    while frames.last() != Some(&3) {
        let message = stream.next().await.expect("no end").expect("it is not too slow");
        if let Some(v1::watch_frames_response::Event::Frame(frame)) = message.event
            && frame.chunk.is_none_or(|chunk| chunk.index == 0)
        {
            frames.push(frame.frame);
        }
    }
    assert_eq!(frames, [0, 1, 2, 3]);
}

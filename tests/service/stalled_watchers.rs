//! Watchers that do not read neither hold the session up nor cost other watchers a frame.

use std::time::{Duration, Instant};

use nappe_proto::v1;
use nappe_server::{Config, Limits, Reason};
use tokio_stream::StreamExt as _;
use tonic::{Status, Streaming, transport::Channel};
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::dust,
    frames::in_time,
    harness::{Client, Server, assert_reason, config, connect, every, latest},
    proxy::Proxy,
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
            match in_time(stream.next()).await.expect("no end") {
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
        if let Err(status) = in_time(stream.next()).await.expect("a status comes before the end") {
            return status;
        }
    }
}

/// Checks why a watcher ended that fetched nothing for `stall` seconds. As long again is what it leaves kept for it;
/// who comes to read later than that finds the connection cut.
fn assert_stalled(status: &Status, stall: f64, since: Instant) {
    if status.get_details_error_info().is_none() && since.elapsed().as_secs_f64() > 2.0 * stall {
        println!("too late to be told: {status:?}");
        return;
    }
    assert_eq!(assert_reason(status, Reason::WatcherStalled)["seconds"], stall.to_string());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_that_fetches_nothing_ends_and_its_place_is_free() {
    let limits = Limits { max_watchers_per_session: 4, ..Limits::default() };
    let mut server = Server::configured(Config { watcher_stall_seconds: 2.0, limits, ..config() }).await;
    let id = server.session(dust(200, "")).await;
    let begin = Instant::now();
    let mut streams = Vec::new();
    for i in 0..4 {
        let request = if i % 2 == 0 { every(&id, 0) } else { latest(&id) };
        streams.push(stalled(&server, request).await);
    }

    // Frames are kept for all of them, and no more come: they do not read what is there.
    server.step(&id, 30).await;
    server.until(&id, |session| session.watcher_count == 0).await;
    for stream in streams {
        assert_stalled(&status(stream).await, 2.0, begin);
    }
    server.client.watch_frames(every(&id, 30)).await.expect("there is a place");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_that_leaves_the_messages_of_an_ended_watcher_unread_is_cut() {
    let mut server = Server::configured(Config { watcher_stall_seconds: 0.5, ..config() }).await;
    let id = server.session(dust(200, "")).await;
    let line = Proxy::to(server.app.local_addr()).await;
    let channel = Channel::from_shared(line.url()).expect("a URL").connect().await.expect("connected");
    let stream = Client::new(channel).watch_frames(latest(&id)).await.expect("the stream opens").into_inner();
    server.step(&id, 30).await;
    server.until(&id, |session| session.watcher_count == 0).await;
    line.until_closed().await;

    let broken = status(stream).await;
    assert!(broken.get_details_error_info().is_none(), "the connection broke before the status: {broken:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn watchers_that_stall_give_way_when_they_hold_too_much() {
    // A frame is 480 kB. Sessions keep two of them, and watchers may hold thirteen more: each one or two that are being
    // sent, and one that waits.
    let limits = Limits { history_bytes_per_session: 1 << 20, max_held_bytes: 6 << 20, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let id = server.session(dust(200, "")).await;
    let (mut streams, mut left, mut newest) = (Vec::new(), 0, 0);
    while streams.len() < left + 2 {
        assert!(streams.len() < 40, "forty hold more than is allowed");
        let mut stream = stalled(&server, latest(&id)).await;
        // The topology takes room too: what is measured begins after it.
        while frame_of(&mut stream).await.expect("no error").is_none() {}
        streams.push(stream);

        // Enough frames to fill what HTTP/2 buffers: then it stalls, within a frame that it alone holds. The session
        // steps when it is asked to, so that nobody gives way while this test is held up.
        for _ in 0..30 {
            newest = server.step(&id, 1).await.frame;
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        left = server.get(&id).await.watcher_count as usize;
    }
    assert!(left >= 4, "{left}: no more give way than have to");

    // Who it is that gives way, a unit test of the streams knows.
    let mut gave_way = 0;
    for mut stream in streams {
        let ended = loop {
            match frame_of(&mut stream).await {
                Ok(frame) if frame == Some(newest) => break None,
                Ok(_) => {}
                Err(status) => break Some(status),
            }
        };
        if let Some(status) = ended {
            assert_eq!(assert_reason(&status, Reason::WatcherStalled)["allowed"], "6291456");
            gave_way += 1;
        }
    }
    assert!(gave_way >= 2, "{gave_way}");
}

/// The number of the frame in the next message, if it is one.
async fn frame_of(stream: &mut Streaming<v1::WatchFramesResponse>) -> Result<Option<u64>, Status> {
    let message = in_time(stream.next()).await.expect("no end")?;
    Ok(match message.event {
        Some(v1::watch_frames_response::Event::Frame(frame)) => Some(frame.frame),
        _ => None,
    })
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
    let mut server = Server::configured(Config { watcher_stall_seconds: 1.0, limits, ..config() }).await;
    let id = server.session(dust(200, "steps = 60")).await;
    let begin = Instant::now();
    let paced = v1::WatchFramesRequest { pace_to_watcher: true, ..every(&id, 0) };
    let watcher = stalled(&server, paced).await;
    server.play(&id).await;
    server.until(&id, |session| session.watcher_count == 0).await;
    assert_stalled(&status(watcher).await, 1.0, begin);
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
        let message = in_time(stream.next()).await.expect("no end").expect("it is not too slow");
        if let Some(v1::watch_frames_response::Event::Frame(frame)) = message.event
            && frame.chunk.is_none_or(|chunk| chunk.index == 0)
        {
            frames.push(frame.frame);
        }
    }
    assert_eq!(frames, [0, 1, 2, 3]);
}

//! Watchers that do not read neither hold the session up nor cost other watchers a frame.

use std::time::Instant;

use nappe_proto::v1;
use nappe_server::{Limits, Reason};
use tokio_stream::StreamExt as _;
use tonic::Streaming;

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
    assert_eq!(server.get(&id).await.watcher_count, WATCHERS as u32, "they were there all the time");

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

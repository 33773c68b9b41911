//! The client library against the real server: large topologies, a connection that breaks, a reader that is slow,
//! and calls that take long.

use std::time::{Duration, Instant};

use nappe_client::{
    Client, ClientError, CreateSession, Delivery, Event, FrameStream, Reason, ReconnectPolicy, Wait,
    WatchOptions, v1,
};

use crate::{
    cloth_scenes::{dust, sheet_with},
    frames::in_time,
    harness::Server,
    proxy::Proxy,
};

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_comes_back_after_its_connection_breaks_and_misses_nothing() {
    let mut server = Server::start().await;
    let proxy = Proxy::to(server.app.local_addr()).await;
    let client = Client::connect(&proxy.url()).await.expect("connected");

    let text = sheet_with(6, "steps = 400");
    let created = client.create_session(CreateSession::from_text(text)).await.expect("made");
    let id = created.session.session_id;
    let options = WatchOptions {
        delivery: Delivery::Every,
        from_frame: Some(0),
        reconnect: ReconnectPolicy::default(),
        ..WatchOptions::default()
    };

    let mut frames = client.watch(&id, options).await.expect("a stream");
    client.step(&id, 100, Wait::Yes).await.expect("steps");

    let (mut next, mut broken, mut reconnected) = (0, 0, 0);
    while let Some(event) = in_time(frames.next()).await {
        match event.expect("the library comes back by itself") {
            Event::Frame(frame) => {
                assert_eq!(frame.frame, next, "neither a gap nor a repeat");
                next += 1;
                if next == 50 {
                    proxy.cut();
                }
                if next == 90 {
                    // Past the proxy: its connection may not be back yet.
                    server.play(&id).await;
                }
            }
            Event::Broken { .. } => broken += 1,
            Event::Reconnected { .. } => reconnected += 1,
            Event::Topology(topology) => assert_eq!(topology.particle_count, 36),
            Event::End(end) => assert_eq!((end.frame, end.step), (400, 400)),
            Event::Change(_) | Event::Progress(_) => {}
            other => panic!("not expected: {other:?}"),
        }
    }

    assert_eq!((next, broken, reconnected), (401, 1, 1));
}

/// The error that a stream ends with, and how often it broke before.
async fn end_of(frames: &mut FrameStream) -> (ClientError, u32) {
    let mut broken = 0;
    loop {
        match in_time(frames.next()).await.expect("it ends with an error") {
            Ok(Event::Broken { .. }) => broken += 1,
            Ok(_) => {}
            Err(error) => return (error, broken),
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_whose_server_is_gone_is_told_and_does_not_wait_for_it_to_the_end_of_its_attempts() {
    let server = Server::start().await;
    let proxy = Proxy::to(server.app.local_addr()).await;
    let client = Client::connect(&proxy.url()).await.expect("connected");
    let created = client.create_session(CreateSession::from_text(sheet_with(4, ""))).await.expect("made");

    // Attempts without end: that nobody listens is the only end.
    let refused_limit = Duration::from_millis(300);
    let reconnect = ReconnectPolicy { max_attempts: u32::MAX, refused_limit, ..ReconnectPolicy::default() };
    let options = WatchOptions { reconnect, ..WatchOptions::default() };
    let mut frames = client.watch(&created.session.session_id, options).await.expect("a stream");
    while !matches!(in_time(frames.next()).await, Some(Ok(Event::Frame(_)))) {}

    proxy.leave();
    proxy.cut();
    let begin = Instant::now();
    let (error, broken) = end_of(&mut frames).await;
    assert!(begin.elapsed() >= refused_limit, "{:?}", begin.elapsed());
    assert!(matches!(error, ClientError::Connect { .. }), "{error}");
    assert!(error.to_string().contains(&proxy.url()), "{error}");
    assert_eq!(broken, 1, "it is told once");
    assert!(in_time(frames.next()).await.is_none(), "nothing follows");
    assert!(ReconnectPolicy::default().refused_limit < Duration::from_secs(3));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_that_comes_back_is_never_given_the_frames_of_another_session() {
    let mut server = Server::start().await;
    let proxy = Proxy::to(server.app.local_addr()).await;
    let client = Client::connect(&proxy.url()).await.expect("connected");

    let named = |side| CreateSession {
        session_id: "the-same".to_owned(),
        ..CreateSession::from_text(sheet_with(side, ""))
    };
    for delivery in [Delivery::Every, Delivery::Latest] {
        let first = client.create_session(named(4)).await.expect("made").session;
        server.step("the-same", 10).await;
        let from_frame = (delivery == Delivery::Every).then_some(0);
        let options = WatchOptions { delivery, from_frame, ..WatchOptions::default() };
        let mut frames = client.watch("the-same", options).await.expect("a stream");
        while !matches!(in_time(frames.next()).await, Some(Ok(Event::Frame(frame))) if frame.frame == 10) {}
        assert_eq!(frames.session_uid(), first.uid);

        // While the client is away, its session goes, and another is given the id.
        proxy.shut();
        proxy.cut();
        let away = v1::DeleteSessionRequest::of("the-same");
        server.client.delete_session(away.clone()).await.expect("deleted");
        let direct = Client::connect(&server.app.url()).await.expect("connected");
        let second = direct.create_session(named(4)).await.expect("made").session;
        server.step("the-same", 20).await;
        proxy.open();

        let (refused, _) = end_of(&mut frames).await;
        assert_eq!(refused.known_reason(), Some(Reason::SessionReplaced), "{refused}");
        let metadata = &refused.server().expect("the server refused").metadata;
        assert_eq!((&metadata["session_uid"], &metadata["expected_uid"]), (&second.uid, &first.uid));
        assert!(in_time(frames.next()).await.is_none(), "nothing follows");
        server.client.delete_session(away).await.expect("deleted");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_topology_in_pieces_is_put_together() {
    let server = Server::start().await;
    let client = Client::connect(&server.app.url()).await.expect("connected");
    let created = client.create_session(CreateSession::from_text(dust(300, ""))).await.expect("made");
    let mut frames =
        client.watch(&created.session.session_id, WatchOptions::default()).await.expect("a stream");
    let Some(Ok(Event::Topology(topology))) = in_time(frames.next()).await else {
        panic!("the topology comes first")
    };
    let body = &topology.bodies[0];
    assert_eq!((body.triangles.len(), body.uv.len()), (2 * 299 * 299, 90_000));
    let cell = 298 * 299 + 298;
    assert_eq!(body.triangles[2 * cell + 1], [89_699, 89_999, 89_998], "the last triangle of the last cell");
    let Some(Ok(Event::Change(present))) = in_time(frames.next()).await else { panic!("then how it stands") };
    assert_eq!((present.kind(), present.state()), (v1::ChangeKind::Present, v1::SessionState::Paused));
    let first = in_time(frames.next()).await;
    assert!(matches!(first, Some(Ok(Event::Frame(frame))) if frame.positions.len() == 90_000));
}

#[tokio::test(flavor = "multi_thread")]
async fn few_old_frames_are_on_their_way_before_the_newest() {
    let mut server = Server::start().await;
    let client = Client::connect(&server.app.url()).await.expect("connected");

    // 120 kB per frame, and nobody reads: what is on its way fills up, and then the newest waits.
    let text = dust(100, "frame_interval = 10");
    let id = client.create_session(CreateSession::from_text(text)).await.expect("made").session.session_id;
    let mut frames = client.watch(&id, WatchOptions::latest(0.0)).await.expect("a stream");
    while !matches!(in_time(frames.next()).await, Some(Ok(Event::Frame(_)))) {}
    for _ in 0..80 {
        server.step(&id, 10).await;
    }

    let mut old_count = 0;
    loop {
        let event = in_time(frames.next()).await.expect("no end").expect("no error");
        match event {
            Event::Frame(frame) if frame.frame == 80 => break,
            Event::Frame(_) => old_count += 1,
            _ => {}
        }
    }
    // The window of 256 KiB holds two and a part, and two more may wait in the server. With 4 MiB: 35.
    println!("{old_count} frames are old");
    assert!(old_count <= 8, "{old_count} frames came before the newest");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_call_that_takes_long_is_waited_for() {
    let server = Server::start().await;
    let proxy = Proxy::to(server.app.local_addr()).await;
    let client = Client::connect(&proxy.url()).await.expect("connected");
    let mut ids = Vec::new();
    for _ in 0..2 {
        let created = client.create_session(CreateSession::from_text(sheet_with(4, ""))).await;
        ids.push(created.expect("made").session.session_id);
    }

    // Longer than what the server answers at once may take; as long as a step of much snow does.
    let begin = Instant::now();
    proxy.hold(Duration::from_secs(11));
    let calls = async { tokio::join!(client.pause(&ids[0], Wait::Yes), client.delete_session(&ids[1])) };
    let (paused, deleted) = in_time(Box::pin(calls)).await;
    assert!(begin.elapsed() > Duration::from_secs(10), "the line was held: {:?}", begin.elapsed());
    paused.expect("paused, however long it took");
    deleted.expect("deleted, however long it took");
}

//! The client library against the real server: large topologies, and a connection that breaks.

use std::{
    net::SocketAddr,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use nappe_client::{Client, CreateSession, Delivery, Event, Reason, ReconnectPolicy, Wait, WatchOptions, v1};
use tokio::{
    io::copy_bidirectional,
    net::{TcpListener, TcpStream},
    sync::Notify,
};

use crate::{
    cloth_scenes::{dust, sheet_with},
    harness::Server,
};

/// A proxy whose connections can be cut.
struct Proxy {
    address: SocketAddr,
    cut: Arc<Notify>,
    /// Whether new connections are closed at once.
    is_shut: Arc<AtomicBool>,
}

impl Proxy {
    async fn to(server: SocketAddr) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("an address");

        let (cut, is_shut) = (Arc::new(Notify::new()), Arc::new(AtomicBool::new(false)));
        let shared = (Arc::clone(&cut), Arc::clone(&is_shut));
        tokio::spawn(async move {
            while let Ok((mut inner, _)) = listener.accept().await {
                if shared.1.load(Ordering::SeqCst) {
                    continue;
                }
                let cut = Arc::clone(&shared.0);
                tokio::spawn(async move {
                    let mut outer = TcpStream::connect(server).await.expect("the server listens");
                    tokio::select! {
                        _ = copy_bidirectional(&mut inner, &mut outer) => {}
                        () = cut.notified() => {}
                    }
                });
            }
        });

        Self { address, cut, is_shut }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_comes_back_after_its_connection_breaks_and_misses_nothing() {
    let mut server = Server::start().await;
    let proxy = Proxy::to(server.app.local_addr()).await;
    let client = Client::connect(&format!("http://{}", proxy.address)).await.expect("connected");

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

    let (mut next, mut reconnected) = (0, 0);
    while let Some(event) = frames.next().await {
        match event.expect("the library comes back by itself") {
            Event::Frame(frame) => {
                assert_eq!(frame.frame, next, "neither a gap nor a repeat");
                next += 1;
                if next == 50 {
                    proxy.cut.notify_waiters();
                }
                if next == 90 {
                    // Past the proxy: its connection may not be back yet.
                    server.play(&id).await;
                }
            }
            Event::Reconnected { .. } => reconnected += 1,
            Event::Topology(topology) => assert_eq!(topology.particle_count, 36),
            Event::End(end) => assert_eq!((end.frame, end.step), (400, 400)),
            Event::Change(_) | Event::Progress(_) => {}
            other => panic!("not expected: {other:?}"),
        }
    }

    assert_eq!((next, reconnected), (401, 1));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_that_comes_back_is_never_given_the_frames_of_another_session() {
    let mut server = Server::start().await;
    let proxy = Proxy::to(server.app.local_addr()).await;
    let client = Client::connect(&format!("http://{}", proxy.address)).await.expect("connected");

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
        while !matches!(frames.next().await, Some(Ok(Event::Frame(frame))) if frame.frame == 10) {}
        assert_eq!(frames.session_uid(), first.uid);

        // While the client is away, its session goes, and another is given the id.
        proxy.is_shut.store(true, Ordering::SeqCst);
        proxy.cut.notify_waiters();
        let away = v1::DeleteSessionRequest::of("the-same");
        server.client.delete_session(away.clone()).await.expect("deleted");
        let direct = Client::connect(&server.app.url()).await.expect("connected");
        let second = direct.create_session(named(4)).await.expect("made").session;
        server.step("the-same", 20).await;
        proxy.is_shut.store(false, Ordering::SeqCst);

        let refused = frames.next().await.expect("an end").expect_err("another session");
        assert_eq!(refused.known_reason(), Some(Reason::SessionReplaced), "{refused}");
        let metadata = &refused.server().expect("the server refused").metadata;
        assert_eq!((&metadata["session_uid"], &metadata["expected_uid"]), (&second.uid, &first.uid));
        assert!(frames.next().await.is_none(), "nothing follows");
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
    let Some(Ok(Event::Topology(topology))) = frames.next().await else { panic!("the topology comes first") };
    let body = &topology.bodies[0];
    assert_eq!((body.triangles.len(), body.uv.len()), (2 * 299 * 299, 90_000));
    let cell = 298 * 299 + 298;
    assert_eq!(body.triangles[2 * cell + 1], [89_699, 89_999, 89_998], "the last triangle of the last cell");
    let Some(Ok(Event::Change(present))) = frames.next().await else { panic!("then how it stands") };
    assert_eq!((present.kind(), present.state()), (v1::ChangeKind::Present, v1::SessionState::Paused));
    assert!(matches!(frames.next().await, Some(Ok(Event::Frame(frame))) if frame.positions.len() == 90_000));
}

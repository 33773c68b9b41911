//! The client library against the real server: large topologies, and a connection that breaks.

use std::{net::SocketAddr, sync::Arc};

use nappe_client::{Client, CreateSession, Delivery, Event, ReconnectPolicy, Wait, WatchOptions};
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
}

impl Proxy {
    async fn to(server: SocketAddr) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("an address");

        let cut = Arc::new(Notify::new());
        let shared = Arc::clone(&cut);
        tokio::spawn(async move {
            while let Ok((mut inner, _)) = listener.accept().await {
                let cut = Arc::clone(&shared);
                tokio::spawn(async move {
                    let mut outer = TcpStream::connect(server).await.expect("the server listens");
                    tokio::select! {
                        _ = copy_bidirectional(&mut inner, &mut outer) => {}
                        () = cut.notified() => {}
                    }
                });
            }
        });

        Self { address, cut }
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
            other => panic!("not expected: {other:?}"),
        }
    }

    assert_eq!((next, reconnected), (401, 1));
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
    assert!(matches!(frames.next().await, Some(Ok(Event::Frame(frame))) if frame.positions.len() == 90_000));
}

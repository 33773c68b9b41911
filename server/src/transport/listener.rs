//! The listener: a bounded number of connections, none of them silent, all of them closed in the end.
//!
//! The framework's own server never closes a silent connection, and its graceful shutdown waits
//! for streams without end. Here a connection must say something in time, and a drain that takes
//! too long cuts what is left.

use std::{convert::Infallible, sync::Arc, time::Duration};

use http::{Request, Response};
use hyper::body::Incoming;
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::conn::auto::Builder,
    service::TowerToHyperService,
};
use tokio::{
    net::{TcpListener, TcpStream},
    sync::Semaphore,
    task::JoinSet,
    time::timeout,
};
use tokio_util::sync::CancellationToken;
use tonic::body::Body;
use tower::util::BoxCloneSyncService;

/// HTTP/2 flow control: bytes in flight per stream.
const STREAM_WINDOW: u32 = 4 << 20;
/// Bytes in flight per connection.
const CONNECTION_WINDOW: u32 = 16 << 20;
/// Bytes per frame of HTTP/2.
const FRAME_SIZE: u32 = 1 << 20;
/// Time between pings on an open connection.
const PING_INTERVAL: Duration = Duration::from_secs(10);
/// A peer that does not answer a ping in this time is gone.
const PING_TIMEOUT: Duration = Duration::from_secs(20);
/// Length of the preface that opens HTTP/2; shorter than any HTTP/1.1 request with a host.
const PREFACE_BYTES: usize = 24;

/// Bounds of the listener.
#[derive(Clone, Debug)]
pub(crate) struct ListenerSettings {
    /// Connections at a time.
    pub max_connections: u32,
    /// Calls in progress on one connection.
    pub max_streams: u32,
    /// How long a new connection may take to say what it speaks.
    pub handshake: Duration,
    /// How long connections may take to end after `draining`.
    pub drain: Duration,
    /// Cancelled when the server begins to end.
    pub draining: CancellationToken,
}

/// What answers the requests of all connections.
pub(crate) type Handler = BoxCloneSyncService<Request<Incoming>, Response<Body>, Infallible>;

/// Accepts connections until `draining`, then lets them end, then cuts them.
pub(crate) async fn serve(listener: TcpListener, handler: Handler, settings: ListenerSettings) {
    let slots = Arc::new(Semaphore::new(settings.max_connections as usize));
    let builder = builder(&settings);
    let mut connections = JoinSet::new();
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            Some(_ended) = connections.join_next() => continue,
            () = settings.draining.cancelled() => break,
        };

        match accepted {
            Ok((stream, peer)) => {
                let Ok(slot) = Arc::clone(&slots).try_acquire_owned() else {
                    tracing::warn!(%peer, "refused: {} connections are open", settings.max_connections);
                    continue;
                };

                let (builder, handler, settings) = (builder.clone(), handler.clone(), settings.clone());
                connections.spawn(async move {
                    let _slot = slot;
                    connection(stream, &builder, handler, &settings).await;
                });
            }
            Err(error) => {
                // Out of file descriptors, most likely: a pause lets others close theirs.
                tracing::warn!("cannot accept a connection: {error}");
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
        }
    }

    drop(listener);
    let all = async { while connections.join_next().await.is_some() {} };
    if timeout(settings.drain, all).await.is_err() {
        tracing::warn!("{} connections did not end in time and are cut", connections.len());
        connections.shutdown().await;
    }
}

fn builder(settings: &ListenerSettings) -> Builder<TokioExecutor> {
    let mut builder = Builder::new(TokioExecutor::new());
    builder.http1().timer(TokioTimer::new()).header_read_timeout(settings.handshake);
    builder
        .http2()
        .timer(TokioTimer::new())
        .initial_stream_window_size(STREAM_WINDOW)
        .initial_connection_window_size(CONNECTION_WINDOW)
        .max_frame_size(FRAME_SIZE)
        .max_concurrent_streams(settings.max_streams)
        .keep_alive_interval(PING_INTERVAL)
        .keep_alive_timeout(PING_TIMEOUT);
    builder
}

async fn connection(
    stream: TcpStream,
    builder: &Builder<TokioExecutor>,
    handler: Handler,
    settings: &ListenerSettings,
) {
    // A frame must not wait for the next one to fill a packet.
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!("TCP_NODELAY cannot be set: {error}");
    }

    let speaks = tokio::select! {
        spoke = timeout(settings.handshake, first_bytes(&stream)) => spoke.unwrap_or(false),
        () = settings.draining.cancelled() => false,
    };
    if !speaks {
        return;
    }

    let connection = builder.serve_connection(TokioIo::new(stream), TowerToHyperService::new(handler));
    tokio::pin!(connection);
    let ended = tokio::select! {
        ended = connection.as_mut() => ended,
        () = settings.draining.cancelled() => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    };
    if let Err(error) = ended {
        tracing::debug!("a connection broke: {error}");
    }
}

/// Waits for enough bytes to tell HTTP/2 from HTTP/1.1; false if the peer closed the connection.
async fn first_bytes(stream: &TcpStream) -> bool {
    let mut bytes = [0; PREFACE_BYTES];
    loop {
        match stream.peek(&mut bytes).await {
            Ok(0) | Err(_) => return false,
            Ok(PREFACE_BYTES) => return true,
            // Peeking again would return at once with the same bytes.
            Ok(_) => tokio::time::sleep(Duration::from_millis(10)).await,
        }
    }
}

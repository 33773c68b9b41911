//! The listener: a bounded number of connections, none of them silent, all of them closed in the end.
//!
//! The framework's own server never closes a silent connection, and its graceful shutdown waits
//! for streams without end. Here a connection must say something in time, and a drain that takes
//! too long cuts what is left.

use std::{convert::Infallible, io, time::Duration};

use http::{Request, Response};
use hyper::body::Incoming;
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::conn::auto::Builder,
    service::TowerToHyperService,
};
use socket2::{SockRef, TcpKeepalive};
use tokio::{
    net::{TcpListener, TcpStream},
    task::JoinSet,
    time::timeout,
};
use tokio_util::sync::CancellationToken;
use tonic::body::Body;
use tower::util::BoxCloneSyncService;

use super::connections::{Connections, Full};

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
/// Silence after which TCP asks whether a peer is alive, and time between its questions; on Linux all of them
/// together last no longer than the time below.
const ALIVE_TIME: Duration = Duration::from_secs(20);
const ALIVE_INTERVAL: Duration = Duration::from_secs(10);
/// A peer that acknowledges nothing in this time is gone.
#[cfg(target_os = "linux")]
const ACKNOWLEDGE_TIME: Duration = Duration::from_secs(40);
/// Length of the preface that opens HTTP/2; shorter than any HTTP/1.1 request with a host.
const PREFACE_BYTES: usize = 24;

/// Bounds of the listener.
#[derive(Clone, Debug)]
pub(crate) struct ListenerSettings {
    /// Connections at a time.
    pub max_connections: u32,
    /// Connections at a time from one address.
    pub max_connections_per_address: u32,
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
    let places = Connections::new(settings.max_connections, settings.max_connections_per_address);
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
                let place = match places.place(peer.ip()) {
                    Ok(place) => place,
                    Err(Full::Everywhere) => {
                        tracing::warn!(%peer, "refused: {} connections are open", settings.max_connections);
                        continue;
                    }
                    Err(Full::FromThere) => {
                        let count = settings.max_connections_per_address;
                        tracing::warn!(%peer, "refused: {count} connections are open from this address");
                        continue;
                    }
                };

                let (builder, handler, settings) = (builder.clone(), handler.clone(), settings.clone());
                connections.spawn(async move {
                    let _place = place;
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
    if let Err(error) = set_options(&stream) {
        tracing::debug!("the options of a connection cannot be set: {error}");
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

/// A frame must not wait for the next one to fill a packet, and a peer whose machine is gone must be noticed:
/// also by HTTP/1.1, which has no pings, and while bytes wait to be acknowledged.
fn set_options(stream: &TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let socket = SockRef::from(stream);
    let alive = TcpKeepalive::new().with_time(ALIVE_TIME).with_interval(ALIVE_INTERVAL);
    socket.set_tcp_keepalive(&alive)?;
    #[cfg(target_os = "linux")]
    socket.set_tcp_user_timeout(Some(ACKNOWLEDGE_TIME))?;
    Ok(())
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

//! The listener: a bounded number of connections, none of them silent or idle, all closed in the end.
//!
//! The framework's own server never closes a silent connection, and its graceful shutdown waits
//! for streams without end. Here a connection must say something in time, and a drain that takes
//! too long cuts what is left.

use std::{convert::Infallible, io, net::SocketAddr, sync::Arc, time::Duration};

use http::{Request, Response};
use hyper::{body::Incoming, service::service_fn};
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::conn::auto::Builder,
};
use socket2::{SockRef, TcpKeepalive};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpListener, TcpStream},
    task::JoinSet,
    time::timeout,
};
use tokio_util::sync::CancellationToken;
use tonic::body::Body;
use tower::{ServiceExt as _, util::BoxCloneSyncService};

use super::{
    activity::Activity,
    connections::{Connections, Place},
    progress::Progress,
};
#[cfg(unix)]
use crate::address::SocketFile;
use crate::{
    address::Address,
    caller::Caller,
    counters::Counters,
    error::Reason,
    refusals::{Call, Refusals},
};

/// HTTP/2 flow control: bytes of requests in flight per stream, a piece of an upload.
const STREAM_WINDOW: u32 = 1 << 20;
/// Bytes of requests in flight per connection: as many as its peer can make the server hold unread.
const CONNECTION_WINDOW: u32 = 4 << 20;
/// Bytes per frame of a request; a frame is held until it is whole.
const FRAME_SIZE: u32 = 256 << 10;
/// Bytes of a request's headers that are read. Fewer are allowed: what lies between is refused with a reason,
/// and what lies above with 431 of HTTP.
const HEADER_LIST_BYTES: u32 = 64 << 10;
/// How long a connection that was asked to end may take, once it has no calls.
const GOODBYE_TIME: Duration = Duration::from_secs(5);
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

/// What accepts connections.
#[derive(Debug)]
pub(crate) enum Listener {
    Tcp(TcpListener),
    /// With its file, which goes with it.
    #[cfg(unix)]
    Unix {
        listener: tokio::net::UnixListener,
        _file: SocketFile,
    },
}

/// What carries a connection.
enum Line {
    Tcp(TcpStream, SocketAddr),
    #[cfg(unix)]
    Unix(tokio::net::UnixStream),
}

impl Line {
    fn caller(&self) -> Caller {
        match self {
            Self::Tcp(_, peer) => Caller::Tcp(*peer),
            #[cfg(unix)]
            Self::Unix(_) => Caller::Unix,
        }
    }
}

impl Listener {
    /// Listens at an address; returns it with the port that was free.
    ///
    /// # Errors
    /// If the system refuses.
    pub(crate) fn bind(address: &Address) -> io::Result<(Address, Self)> {
        match address {
            Address::Tcp(address) => {
                let listener = std::net::TcpListener::bind(address)?;
                listener.set_nonblocking(true)?;
                let address = listener.local_addr()?;
                Ok((address.into(), Self::Tcp(TcpListener::from_std(listener)?)))
            }
            #[cfg(unix)]
            Address::Unix(path) => {
                let (file, listener) = SocketFile::bind(path)?;
                let listener = tokio::net::UnixListener::from_std(listener)?;
                Ok((address.clone(), Self::Unix { listener, _file: file }))
            }
            #[cfg(not(unix))]
            Address::Unix(_) => Err(io::ErrorKind::Unsupported.into()),
        }
    }

    async fn accept(&self) -> io::Result<Line> {
        match self {
            Self::Tcp(listener) => {
                let (stream, peer) = listener.accept().await?;
                Ok(Line::Tcp(stream, peer))
            }
            #[cfg(unix)]
            Self::Unix { listener, .. } => Ok(Line::Unix(listener.accept().await?.0)),
        }
    }
}

/// Bounds of the listener.
#[derive(Clone, Debug)]
pub(crate) struct ListenerSettings {
    /// Connections at a time.
    pub max_connections: u32,
    /// Connections at a time from one address.
    pub max_connections_per_address: u32,
    /// Calls in progress on one connection.
    pub max_streams: u32,
    /// How long a stranger's connection may be open.
    pub handshake: Duration,
    /// How long a connection may be open without a call in progress.
    pub idle: Duration,
    /// How long connections may take to end after `draining`.
    pub drain: Duration,
    /// How long a connection may write nothing after `draining`.
    pub drain_stall: Duration,
    /// Where bytes that are written are counted.
    pub counters: Arc<Counters>,
    /// Where connections that are refused are counted and told.
    pub refusals: Arc<Refusals>,
    /// Cancelled when the server begins to end.
    pub draining: CancellationToken,
}

/// What answers the requests of all connections.
pub(crate) type Handler = BoxCloneSyncService<Request<Incoming>, Response<Body>, Infallible>;

/// Accepts connections until `draining`, then lets them end, then cuts them.
pub(crate) async fn serve(listener: Listener, handler: Handler, settings: ListenerSettings) {
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
            Ok(line) => {
                let caller = line.caller();
                let Some(place) = place_for(caller, &places, &settings.refusals) else { continue };
                if caller.is_elsewhere() {
                    tracing::info!(%caller, "connected");
                }
                let (builder, handler, settings) = (builder.clone(), handler.clone(), settings.clone());
                connections.spawn(async move { answer(line, &place, &builder, handler, &settings).await });
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

/// A place for a connection. That there is none is counted and told as a refused call is.
fn place_for(caller: Caller, places: &Arc<Connections>, refusals: &Arc<Refusals>) -> Option<Place> {
    let peer = match caller {
        Caller::Tcp(peer) => Some(peer.ip()),
        Caller::Unix => None,
    };
    let place = places.place(peer);
    if place.is_err() {
        Call::new(caller, refusals).refused(Reason::TooManyConnections);
    }
    place.ok()
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
        .max_header_list_size(HEADER_LIST_BYTES)
        .max_concurrent_streams(settings.max_streams)
        .keep_alive_interval(PING_INTERVAL)
        .keep_alive_timeout(PING_TIMEOUT);
    builder
}

/// Answers the calls of a connection until it ends, or its place goes to another.
async fn answer(
    line: Line,
    place: &Place,
    builder: &Builder<TokioExecutor>,
    handler: Handler,
    settings: &ListenerSettings,
) {
    let caller = line.caller();
    match line {
        Line::Tcp(stream, _) => {
            if let Err(error) = set_options(&stream) {
                tracing::debug!("the options of a connection cannot be set: {error}");
            }
            let speaks = tokio::select! {
                spoke = first_bytes(&stream) => spoke,
                () = place.overstayed(settings.handshake) => false,
                () = place.cut() => false,
                () = settings.draining.cancelled() => false,
            };
            if speaks {
                connection(stream, caller, place, builder, handler, settings).await;
            }
        }
        #[cfg(unix)]
        Line::Unix(stream) => connection(stream, caller, place, builder, handler, settings).await,
    }
}

async fn connection(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    caller: Caller,
    place: &Place,
    builder: &Builder<TokioExecutor>,
    handler: Handler,
    settings: &ListenerSettings,
) {
    let (activity, progress) = (Activity::new(), Progress::new(&settings.counters));
    let service = service_fn(|mut request: Request<Incoming>| {
        place.go_with(request.extensions_mut());
        request.extensions_mut().insert(caller);
        let (call, handler) = (activity.begin(), handler.clone());
        async move { handler.oneshot(request).await.map(|answer| answer.map(|body| call.answered(body))) }
    });
    let connection = builder.serve_connection(TokioIo::new(progress.counted(stream)), service);
    tokio::pin!(connection);
    let ended = tokio::select! {
        ended = connection.as_mut() => ended,
        () = place.cut() => return,
        () = asked_to_end(&activity, place, settings) => {
            // A call that begins as the peer is told is still answered.
            connection.as_mut().graceful_shutdown();
            tokio::select! {
                ended = connection => ended,
                () = place.cut() => return,
                () = activity.idle(GOODBYE_TIME) => return,
                () = stalled_stranger(&progress, place, settings) => return,
                () = stalled_in_drain(&progress, settings) => {
                    tracing::debug!("a connection is cut: its peer takes nothing while the server drains");
                    return;
                }
            }
        }
    };
    if let Err(error) = ended {
        tracing::debug!("a connection broke: {error}");
    }
}

/// Waits until a connection has been idle for too long, its peer was a stranger for too long, or the server drains.
async fn asked_to_end(activity: &Activity, place: &Place, settings: &ListenerSettings) {
    tokio::select! {
        () = activity.idle(settings.idle) => {}
        () = place.overstayed(settings.handshake) => {}
        () = settings.draining.cancelled() => {}
    }
}

/// Waits until a stranger whose time is over takes nothing any more of what it asked for, such as the page.
async fn stalled_stranger(progress: &Progress, place: &Place, settings: &ListenerSettings) {
    place.overstayed(settings.handshake).await;
    progress.stalled(GOODBYE_TIME).await;
    place.strange().await;
}

/// Waits until the server drains and a connection writes nothing any more: its peer takes nothing, and would take the
/// drain's whole time.
async fn stalled_in_drain(progress: &Progress, settings: &ListenerSettings) {
    settings.draining.cancelled().await;
    progress.stalled(settings.drain_stall).await;
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

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;
    use crate::transport::connections::Standing;

    #[test]
    fn a_connection_for_which_there_is_no_place_is_counted_as_refused() {
        let (places, refusals) = (Connections::new(2, 1), Arc::new(Refusals::default()));
        let caller = |port: u16| Caller::Tcp((Ipv4Addr::LOCALHOST, port).into());
        let known = |caller: Caller| {
            let place = place_for(caller, &places, &refusals).expect("a place");
            let mut request = http::Extensions::new();
            place.go_with(&mut request);
            Standing::of(&request).becomes_known();
            place
        };
        let counted = || {
            let counts = refusals.counts().into_iter();
            counts.filter(|(_, count)| *count > 0).collect::<Vec<_>>()
        };
        let _here = known(caller(1));
        assert!(counted().is_empty());
        assert!(place_for(caller(2), &places, &refusals).is_none(), "one from an address");
        let _unix = known(Caller::Unix);
        assert!(place_for(Caller::Unix, &places, &refusals).is_none(), "two in all");
        assert_eq!(counted(), [(Reason::TooManyConnections, 2)]);
    }
}

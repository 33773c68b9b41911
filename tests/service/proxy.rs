//! A line between a client and a server that can be cut, held up, or is slow.

use std::{
    net::SocketAddr,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _, copy},
    net::{TcpListener, TcpStream, tcp},
    sync::Notify,
    time::Instant,
};

/// Bytes that a slow line takes at a time.
const PIECE_BYTES: usize = 4 << 10;
/// What timers may be late by, which the line makes up for.
const LATENESS: Duration = Duration::from_millis(20);

/// A proxy whose connections can be cut.
pub(crate) struct Proxy {
    address: SocketAddr,
    cut: Arc<Notify>,
    /// When the line carries answers again.
    free: Arc<Mutex<Instant>>,
    /// Whether new connections are closed at once.
    is_shut: Arc<AtomicBool>,
}

impl Proxy {
    /// A line as fast as loopback.
    pub(crate) async fn to(server: SocketAddr) -> Self {
        Self::with(server, Carriage::Rate(f64::INFINITY)).await
    }

    /// A line that carries `rate` bytes per second from the server to its client.
    pub(crate) async fn with_rate(server: SocketAddr, rate: f64) -> Self {
        Self::with(server, Carriage::Rate(rate)).await
    }

    async fn with(server: SocketAddr, carriage: Carriage) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("an address");

        let cut = Arc::new(Notify::new());
        let free = Arc::new(Mutex::new(Instant::now()));
        let is_shut = Arc::new(AtomicBool::new(false));
        let shared = (Arc::clone(&cut), Arc::clone(&free));
        let closed = Arc::clone(&is_shut);
        tokio::spawn(async move {
            while let Ok((inner, _)) = listener.accept().await {
                if closed.load(Ordering::SeqCst) {
                    continue;
                }
                let (cut, free) = shared.clone();
                tokio::spawn(async move {
                    let outer = TcpStream::connect(server).await.expect("the server listens");
                    let ((mut from_client, to_client), (from_server, mut to_server)) =
                        (inner.into_split(), outer.into_split());
                    tokio::select! {
                        _ = copy(&mut from_client, &mut to_server) => {}
                        () = carry(from_server, to_client, carriage, free) => {}
                        () = cut.notified() => {}
                    }
                });
            }
        });

        Self { address, cut, free, is_shut }
    }

    /// A line that keeps to itself that the server wants to end: its farewells, and the pings that belong to them.
    pub(crate) async fn without_farewells(server: SocketAddr) -> Self {
        Self::with(server, Carriage::WithoutFarewells).await
    }

    /// Where clients connect.
    pub(crate) fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Keeps what the server sends for a time, as if the server were busy.
    pub(crate) fn hold(&self, time: Duration) {
        *self.free.lock().expect("no panic") = Instant::now() + time;
    }

    /// Closes new connections at once, until it opens.
    pub(crate) fn shut(&self) {
        self.is_shut.store(true, Ordering::SeqCst);
    }

    /// Takes connections again.
    pub(crate) fn open(&self) {
        self.is_shut.store(false, Ordering::SeqCst);
    }

    /// Cuts every connection that is open.
    pub(crate) fn cut(&self) {
        self.cut.notify_waiters();
    }
}

/// How a line carries what the server sends.
#[derive(Clone, Copy)]
enum Carriage {
    /// At most so many bytes per second.
    Rate(f64),
    WithoutFarewells,
}

async fn carry(
    from: tcp::OwnedReadHalf,
    to: tcp::OwnedWriteHalf,
    carriage: Carriage,
    free: Arc<Mutex<Instant>>,
) {
    match carriage {
        Carriage::Rate(rate) => slowly(from, to, rate, free).await,
        Carriage::WithoutFarewells => without_farewells(from, to).await,
    }
}

/// Copies frames of HTTP/2 but for GOAWAY, and for PINGs that ask for an answer.
async fn without_farewells(mut from: tcp::OwnedReadHalf, mut to: tcp::OwnedWriteHalf) {
    /// Types of frames, and a flag.
    const PING: u8 = 6;
    const GOAWAY: u8 = 7;
    const ACKNOWLEDGED: u8 = 1;
    let mut head = [0; 9];
    while from.read_exact(&mut head).await.is_ok() {
        let length = u32::from_be_bytes([0, head[0], head[1], head[2]]) as usize;
        let mut frame = head.to_vec();
        frame.resize(9 + length, 0);
        if from.read_exact(&mut frame[9..]).await.is_err() {
            return;
        }
        let (kind, flags) = (head[3], head[4]);
        let is_kept = kind == GOAWAY || (kind == PING && flags & ACKNOWLEDGED == 0);
        if !is_kept && to.write_all(&frame).await.is_err() {
            return;
        }
    }
}

/// Copies at most `rate` bytes per second, as a line would: what was not sent in time is lost.
async fn slowly(
    mut from: tcp::OwnedReadHalf,
    mut to: tcp::OwnedWriteHalf,
    rate: f64,
    free: Arc<Mutex<Instant>>,
) {
    let mut piece = [0; PIECE_BYTES];
    let mut sent = Instant::now();
    while let Ok(count @ 1..) = from.read(&mut piece).await {
        let free = *free.lock().expect("no panic");
        let late = Instant::now().checked_sub(LATENESS).unwrap_or(sent);
        sent = sent.max(free).max(late) + Duration::from_secs_f64(count as f64 / rate);
        tokio::time::sleep_until(sent).await;
        if to.write_all(&piece[..count]).await.is_err() {
            return;
        }
    }
}

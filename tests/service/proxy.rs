//! A line between a client and a server that can be cut or held up.

use std::{
    net::SocketAddr,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    time::Duration,
};

use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _, copy},
    net::{TcpListener, TcpStream, tcp},
    sync::Notify,
    task::AbortHandle,
    time::Instant,
};

use crate::frames::in_time;

/// Bytes that a line takes at a time.
const PIECE_BYTES: usize = 4 << 10;

/// A proxy whose connections can be cut.
pub(crate) struct Proxy {
    address: SocketAddr,
    cut: Arc<Notify>,
    /// When the line carries answers again.
    free: Arc<Mutex<Instant>>,
    /// Whether new connections are closed at once.
    is_shut: Arc<AtomicBool>,
    /// Connections that are open.
    open_count: Arc<AtomicUsize>,
    listening: AbortHandle,
}

impl Proxy {
    /// A line as fast as loopback.
    pub(crate) async fn to(server: SocketAddr) -> Self {
        Self::with(server, Carriage::Whole).await
    }

    async fn with(server: SocketAddr, carriage: Carriage) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("an address");

        let cut = Arc::new(Notify::new());
        let free = Arc::new(Mutex::new(Instant::now()));
        let is_shut = Arc::new(AtomicBool::new(false));
        let open_count = Arc::new(AtomicUsize::new(0));
        let shared = (Arc::clone(&cut), Arc::clone(&free), Arc::clone(&open_count));
        let closed = Arc::clone(&is_shut);
        let listening = tokio::spawn(async move {
            while let Ok((inner, _)) = listener.accept().await {
                if closed.load(Ordering::SeqCst) {
                    continue;
                }
                let (cut, free, open_count) = shared.clone();
                open_count.fetch_add(1, Ordering::SeqCst);
                tokio::spawn(async move {
                    let outer = TcpStream::connect(server).await.expect("the server listens");
                    let ((mut from_client, to_client), (from_server, mut to_server)) =
                        (inner.into_split(), outer.into_split());
                    tokio::select! {
                        _ = copy(&mut from_client, &mut to_server) => {}
                        () = carry(from_server, to_client, carriage, free) => {}
                        () = cut.notified() => {}
                    }
                    open_count.fetch_sub(1, Ordering::SeqCst);
                });
            }
        });

        Self { address, cut, free, is_shut, open_count, listening: listening.abort_handle() }
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

    /// Listens no more: new connections are refused.
    pub(crate) fn leave(&self) {
        self.listening.abort();
    }

    /// Cuts every connection that is open.
    pub(crate) fn cut(&self) {
        self.cut.notify_waiters();
    }

    /// Waits until no connection is open.
    pub(crate) async fn until_closed(&self) {
        let closing = async {
            while self.open_count.load(Ordering::SeqCst) > 0 {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        in_time(closing).await;
    }
}

/// How a line carries what the server sends.
#[derive(Clone, Copy)]
enum Carriage {
    /// All of it, once the line is free.
    Whole,
    WithoutFarewells,
}

async fn carry(
    from: tcp::OwnedReadHalf,
    to: tcp::OwnedWriteHalf,
    carriage: Carriage,
    free: Arc<Mutex<Instant>>,
) {
    match carriage {
        Carriage::Whole => once_free(from, to, free).await,
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

/// Copies what comes, once the line is free.
async fn once_free(mut from: tcp::OwnedReadHalf, mut to: tcp::OwnedWriteHalf, free: Arc<Mutex<Instant>>) {
    let mut piece = [0; PIECE_BYTES];
    while let Ok(count @ 1..) = from.read(&mut piece).await {
        let free = *free.lock().expect("no panic");
        tokio::time::sleep_until(free).await;
        if to.write_all(&piece[..count]).await.is_err() {
            return;
        }
    }
}

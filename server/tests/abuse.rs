//! The built program while peers from another address do their worst: an honest client is answered all the same, and
//! the memory stays bounded.

#![cfg(target_os = "linux")]
#![allow(clippy::print_stdout, reason = "measurements are shown when a test fails")]

mod support;

use std::{
    net::{Ipv4Addr, SocketAddr},
    process::{Child, Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use nappe_proto::v1::{
    CreateSessionRequest, GetServerInfoRequest, PauseSessionRequest, create_session_request::Scene,
    simulation_service_client::SimulationServiceClient,
};
use support::first_line;
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::{TcpSocket, TcpStream},
    task::JoinSet,
    time::timeout,
};

/// How long each of them goes on, at least.
const TIME: Duration = Duration::from_secs(3);
/// Time after which a call counts as not answered, on a machine where others are at work too.
const PATIENCE: Duration = Duration::from_mins(1);
/// Connections of each kind of abuse.
const CONNECTIONS: usize = 4;
/// Bytes that the server may grow by, whatever they do. Requests in flight are most of it.
const GROWTH: u64 = 400 << 20;

/// The built server, ended with the test.
struct Server {
    process: Child,
    address: SocketAddr,
}

impl Server {
    fn start() -> Self {
        let mut program = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
        program.args(["--address", "127.0.0.1:0", "--no-token", "--log", "error"]);
        let mut process = program.stdout(Stdio::piped()).spawn().expect("it starts");
        let line = first_line(process.stdout.take().expect("its output"));
        let address = line.trim().rsplit_once("http://").expect("an address").1;
        let address = address.parse().expect("an address");
        Self { process, address }
    }

    /// Bytes of memory that it has.
    fn resident(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.process.id()));
        let status = status.expect("it runs");
        let line = status.lines().find(|line| line.starts_with("VmRSS:")).expect("its memory");
        let kilobytes: u64 = line.split_whitespace().nth(1).and_then(|n| n.parse().ok()).expect("a number");
        kilobytes << 10
    }

    async fn client(&self) -> SimulationServiceClient<tonic::transport::Channel> {
        SimulationServiceClient::connect(format!("http://{}", self.address)).await.expect("connected")
    }

    /// A connection of somebody else: it comes from another address.
    async fn stranger(&self) -> std::io::Result<TcpStream> {
        let socket = TcpSocket::new_v4()?;
        socket.bind(SocketAddr::from((Ipv4Addr::new(127, 0, 0, 66), 0)))?;
        socket.connect(self.address).await
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A header that is the newest entry of the table, number 62.
const NEWEST: u8 = 0xbe;

/// Frames of HTTP/2.
mod frames {
    pub(super) const DATA: u8 = 0;
    pub(super) const HEADERS: u8 = 1;
    pub(super) const RST_STREAM: u8 = 3;
    pub(super) const SETTINGS: u8 = 4;
    pub(super) const CONTINUATION: u8 = 9;
    pub(super) const END_HEADERS: u8 = 4;

    pub(super) fn frame(kind: u8, flags: u8, stream: u32, payload: &[u8]) -> Vec<u8> {
        let length = (payload.len() as u32).to_be_bytes();
        [&length[1..], &[kind, flags], &stream.to_be_bytes(), payload].concat()
    }

    pub(super) fn opening() -> Vec<u8> {
        [b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_vec(), frame(SETTINGS, 0, 0, &[])].concat()
    }

    /// The headers of a call, none of them compressed.
    pub(super) fn headers(method: &str) -> Vec<u8> {
        let path = format!("/nappe.v1.SimulationService/{method}");
        let pairs = [
            (":method", "POST"),
            (":scheme", "http"),
            (":authority", "localhost"),
            (":path", &path),
            ("content-type", "application/grpc"),
            ("te", "trailers"),
        ];
        pairs.iter().flat_map(|(name, value)| literal(0, name, value)).collect()
    }

    /// A header written out; `kind` 0x40 also puts it into the table.
    pub(super) fn literal(kind: u8, name: &str, value: &str) -> Vec<u8> {
        [vec![kind], text(name), text(value)].concat()
    }

    fn text(text: &str) -> Vec<u8> {
        let length = text.len();
        let head = match length.checked_sub(127) {
            None => vec![length as u8],
            // Two more digits of seven bits are enough for what is sent here.
            Some(rest) => vec![127, (rest & 127) as u8 | 128, (rest >> 7) as u8],
        };
        [head, text.as_bytes().to_vec()].concat()
    }
}

use frames::{CONTINUATION, DATA, END_HEADERS, HEADERS, RST_STREAM, frame, headers, literal, opening};

/// What a peer does to a connection; false once the server has had enough of it.
#[derive(Clone, Copy, Debug)]
enum Abuse {
    /// Calls that are taken back at once, without end.
    RapidReset,
    /// Headers that never end.
    Continuation,
    /// 4 MiB announced on every stream, and a few bytes sent.
    Announced,
    /// A body that stops, over HTTP/1.1.
    BodyStops,
    /// A large header in the table, named again and again.
    HeaderBomb,
    /// Nothing after the opening; nothing is read.
    HalfOpen,
}

impl Abuse {
    const ALL: [Self; 6] = [
        Self::RapidReset,
        Self::Continuation,
        Self::Announced,
        Self::BodyStops,
        Self::HeaderBomb,
        Self::HalfOpen,
    ];

    /// Goes on without end, on one connection after the other, and counts those that the server closes.
    async fn go_on(self, server: SocketAddr, closed: Arc<AtomicUsize>) {
        loop {
            let socket = TcpSocket::new_v4().expect("a socket");
            socket.bind(SocketAddr::from((Ipv4Addr::new(127, 0, 0, 66), 0))).expect("loopback");
            let Ok(mut stream) = socket.connect(server).await else {
                tokio::task::yield_now().await;
                continue;
            };
            // Whoever is closed comes back, however that was.
            let _ = self.send(&mut stream).await;
            closed.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Whether the server has to close such connections.
    fn is_closed(self) -> bool {
        matches!(self, Self::RapidReset | Self::Continuation | Self::HeaderBomb)
    }

    /// Sends until the server closes the connection.
    async fn send(self, stream: &mut TcpStream) -> std::io::Result<()> {
        let call = |stream, method| frame(HEADERS, END_HEADERS, stream, &headers(method));
        let announced: Vec<u8> = [&[0], &(4_u32 << 20).to_be_bytes()[..], &[0; 100]].concat();
        match self {
            Self::BodyStops => {
                let head = "POST /nappe.v1.SimulationService/GetSession HTTP/1.1\r\nHost: localhost\r\n\
                            Content-Type: application/grpc-web+proto\r\nContent-Length: 4000000\r\n\r\n";
                stream.write_all(head.as_bytes()).await?;
                stream.write_all(&announced).await?;
            }
            _ => stream.write_all(&opening()).await?,
        }
        match self {
            Self::RapidReset => {
                for number in (1..).step_by(2) {
                    let reset = frame(RST_STREAM, 0, number, &8_u32.to_be_bytes());
                    stream.write_all(&[call(number, "GetServerInfo"), reset].concat()).await?;
                }
            }
            Self::Continuation => {
                stream.write_all(&frame(HEADERS, 0, 1, &headers("GetServerInfo"))).await?;
                let more = frame(CONTINUATION, 0, 1, &literal(0, "x-more", &"m".repeat(4000)));
                loop {
                    stream.write_all(&more).await?;
                }
            }
            Self::Announced => {
                for number in (1..257).step_by(2) {
                    let data = frame(DATA, 0, number, &announced);
                    stream.write_all(&[call(number, "GetSession"), data].concat()).await?;
                }
            }
            Self::HeaderBomb => {
                let entry = literal(0x40, "x-large", &"l".repeat(3900));
                let bomb = [headers("GetServerInfo"), entry, vec![NEWEST; 10_000]].concat();
                for number in (1..).step_by(2) {
                    stream.write_all(&frame(HEADERS, END_HEADERS, number, &bomb)).await?;
                }
            }
            Self::BodyStops | Self::HalfOpen => {}
        }
        // Answers are read by none but those who wait for their end.
        if matches!(self, Self::HalfOpen) {
            std::future::pending::<()>().await;
        }
        stream.read_to_end(&mut Vec::new()).await.map(|_| ())
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_honest_client_is_answered_whatever_others_do() {
    let server = Server::start();
    let mut honest = server.client().await;
    let scene = Some(Scene::SceneName("demo".to_owned()));
    let made = honest.create_session(CreateSessionRequest { scene, ..Default::default() }).await;
    let id = made.expect("made").into_inner().session.expect("a session").session_id;
    let before = server.resident();

    for abuse in Abuse::ALL {
        let (start, closed) = (Instant::now(), Arc::new(AtomicUsize::new(0)));
        let mut strangers = JoinSet::new();
        for _ in 0..CONNECTIONS {
            strangers.spawn(abuse.go_on(server.address, Arc::clone(&closed)));
        }

        let mut times = Vec::new();
        let mut most = 0;
        let is_over = || {
            let is_owed = abuse.is_closed() && closed.load(Ordering::Relaxed) == 0;
            start.elapsed() > if is_owed { PATIENCE } else { TIME }
        };
        while times.is_empty() || !is_over() {
            let begin = Instant::now();
            if times.len() % 2 == 0 {
                let info = honest.get_server_info(GetServerInfoRequest {});
                timeout(PATIENCE, info).await.expect("in time").expect("answered");
            } else {
                let pause = honest.pause_session(PauseSessionRequest::of(&id));
                timeout(PATIENCE, pause).await.expect("in time").expect("answered");
            }
            times.push(begin.elapsed());
            if times.len() % 100 == 0 {
                most = most.max(server.resident().saturating_sub(before));
            }
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
        times.sort();
        let worst = times[times.len() * 99 / 100];
        strangers.shutdown().await;
        let closed = closed.load(Ordering::Relaxed);
        println!(
            "{abuse:?}: {} calls, 99 % within {worst:?}, {} MiB, {closed} connections closed",
            times.len(),
            most >> 20
        );
        assert!(most < GROWTH, "{abuse:?}: {most} bytes more");
        assert!(closed > 0 || !abuse.is_closed(), "{abuse:?} is put up with");
    }

    // Others from that address are served again.
    drop(server.stranger().await.expect("accepted"));
    honest.get_server_info(GetServerInfoRequest {}).await.expect("answered");
}

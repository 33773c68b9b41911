//! The built program among strangers of every kind, on the address of its client and on others: who has the token is
//! answered, and the memory stays as it was.

#![cfg(target_os = "linux")]
#![allow(clippy::print_stdout, reason = "measurements are shown when a test fails")]

mod support;

use std::{
    fs::{self, OpenOptions},
    io::Write as _,
    net::{Ipv4Addr, SocketAddr},
    os::unix::fs::OpenOptionsExt as _,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use nappe_proto::v1::{GetServerInfoRequest, simulation_service_client::SimulationServiceClient};
use support::first_line;
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::{TcpSocket, TcpStream},
    task::JoinSet,
    time::{sleep, timeout},
};
use tonic::{Request, Status, transport::Channel};
use tonic_health::pb::{HealthCheckRequest, health_client::HealthClient};

const TOKEN: &str = "a-token-of-this-test-alone";
/// Strangers from the client's own address, and from each of others: more than there are places, of each and in all.
const HERE: usize = 100;
const ELSEWHERE: [usize; 4] = [50; 4];
/// Calls, one a second.
const CALLS: u32 = 6;
/// Time after which a call counts as not answered, on a machine where others are at work too.
const PATIENCE: Duration = Duration::from_mins(1);
/// Bytes that the server may grow by.
const GROWTH: u64 = 32 << 20;

/// The built server, ended with the test.
struct Server {
    process: Child,
    address: SocketAddr,
    folder: PathBuf,
}

impl Server {
    fn start() -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("strangers-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("made");
        let token = folder.join("token");
        let mut file = OpenOptions::new();
        let mut file = file.write(true).create(true).truncate(true).mode(0o600).open(&token).expect("made");
        writeln!(file, "{TOKEN}").expect("written");

        let mut program = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
        // Only places make strangers go, however slow this machine is.
        program.args(["--address", "127.0.0.1:0", "--handshake-seconds", "300", "--log", "error", "--token"]);
        program.arg(&token).env("XDG_RUNTIME_DIR", &folder);
        let mut process = program.stdout(Stdio::piped()).spawn().expect("it starts");
        let line = first_line(process.stdout.take().expect("its output"));
        let address = line.trim().rsplit_once("http://").expect("an address").1;
        let address = address.parse().expect("an address");
        Self { process, address, folder }
    }

    /// Bytes of memory that it has.
    fn resident(&self) -> u64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.process.id()));
        let status = status.expect("it runs");
        let line = status.lines().find(|line| line.starts_with("VmRSS:")).expect("its memory");
        let kilobytes: u64 = line.split_whitespace().nth(1).and_then(|n| n.parse().ok()).expect("a number");
        kilobytes << 10
    }

    async fn connect(&self) -> Result<Channel, tonic::transport::Error> {
        let endpoint = Channel::from_shared(format!("http://{}", self.address)).expect("a URL");
        endpoint.timeout(PATIENCE).connect().await
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself, and what is left of the folder is in nobody's way.
        let _ = self.process.kill();
        let _ = self.process.wait();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// A request that shows the token.
fn shown<T>(message: T) -> Request<T> {
    let mut request = Request::new(message);
    let value = format!("Bearer {TOKEN}").parse().expect("a header");
    request.metadata_mut().insert("authorization", value);
    request
}

async fn ask(channel: Channel) -> Result<(), Status> {
    let mut client = SimulationServiceClient::new(channel);
    client.get_server_info(shown(GetServerInfoRequest {})).await.map(|_| ())
}

/// Asks on a connection of its own. Where all places are taken by strangers who came within a moment, another attempt
/// follows, as clients make one.
async fn ask_anew(server: &Server) {
    loop {
        let is_answered = match server.connect().await {
            Ok(channel) => ask(channel).await.is_ok(),
            Err(_closed) => false,
        };
        if is_answered {
            return;
        }
        sleep(Duration::from_millis(10)).await;
    }
}

/// What a stranger does.
#[derive(Clone, Copy, Debug)]
enum Stranger {
    NoByte,
    PrefaceAlone,
    HalfAHeader,
    /// Of a method that needs no token.
    HalfABody,
    /// Of a method that needs the token, or of one that does not.
    BodyWithoutEnd(&'static str),
}

impl Stranger {
    const ALL: [Self; 6] = [
        Self::NoByte,
        Self::PrefaceAlone,
        Self::HalfAHeader,
        Self::HalfABody,
        Self::BodyWithoutEnd("UploadMesh"),
        Self::BodyWithoutEnd("OpenLink"),
    ];

    /// Comes from an address, and comes back a second after it was closed, without end.
    async fn go_on(self, from: Ipv4Addr, server: SocketAddr) {
        loop {
            let socket = TcpSocket::new_v4().expect("a socket");
            socket.bind(SocketAddr::from((from, 0))).expect("loopback");
            // Whoever is closed comes back, however that was.
            if let Ok(mut stream) = socket.connect(server).await {
                let _ = self.send(&mut stream).await;
                let _ = stream.read_to_end(&mut Vec::new()).await;
            }
            sleep(Duration::from_secs(1)).await;
        }
    }

    async fn send(self, stream: &mut TcpStream) -> std::io::Result<()> {
        let post = |method: &str, length: &str| {
            format!(
                "POST /nappe.v1.SimulationService/{method} HTTP/1.1\r\nHost: localhost\r\n\
                 Content-Type: application/grpc-web+proto\r\n{length}\r\n\r\n"
            )
        };
        match self {
            Self::NoByte => Ok(()),
            Self::PrefaceAlone => stream.write_all(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n").await,
            Self::HalfAHeader => stream.write_all(b"GET / HTTP/1.1\r\nHost: local").await,
            Self::HalfABody => {
                let head = post("OpenLink", "Content-Length: 500");
                stream.write_all(&[head.as_bytes(), b"\0\0\0\x01\xef\x0a"].concat()).await
            }
            Self::BodyWithoutEnd(method) => {
                stream.write_all(post(method, "Transfer-Encoding: chunked").as_bytes()).await?;
                let piece = [&b"4000\r\n"[..], &[0; 0x4000], b"\r\n"].concat();
                loop {
                    stream.write_all(&piece).await?;
                }
            }
        }
    }
}

/// Where strangers come from, one for each.
fn origins() -> impl Iterator<Item = Ipv4Addr> {
    let elsewhere = (66..).zip(ELSEWHERE).flat_map(|(last, count)| std::iter::repeat_n(last, count));
    std::iter::repeat_n(1, HERE).chain(elsewhere).map(|last| Ipv4Addr::new(127, 0, 0, last))
}

#[tokio::test(flavor = "multi_thread")]
async fn whoever_has_the_token_is_answered_among_strangers_of_every_kind() {
    let server = Server::start();
    let channel = server.connect().await.expect("connected");
    let watch = HealthClient::new(channel.clone()).watch(shown(HealthCheckRequest::default())).await;
    let mut watch = watch.expect("it has the token").into_inner();
    watch.message().await.expect("no error").expect("it serves");
    ask_anew(&server).await;
    let before = server.resident();

    let mut strangers = JoinSet::new();
    for (from, stranger) in origins().zip(Stranger::ALL.into_iter().cycle()) {
        strangers.spawn(stranger.go_on(from, server.address));
    }
    let (mut most, mut worst) = (0, Duration::ZERO);
    for _ in 0..CALLS {
        sleep(Duration::from_secs(1)).await;
        let begin = Instant::now();
        timeout(PATIENCE, ask(channel.clone())).await.expect("in time").expect("answered");
        let known = begin.elapsed();
        let begin = Instant::now();
        timeout(PATIENCE, ask_anew(&server)).await.expect("in time");
        let anew = begin.elapsed();
        println!("{known:?} on a known connection, {anew:?} with a new one");
        worst = worst.max(known).max(anew);
        most = most.max(server.resident().saturating_sub(before));
    }
    println!("{} strangers: {worst:?} for a call at most, {} KiB", strangers.len(), most >> 10);
    assert!(most <= GROWTH, "{most} bytes more");

    // The stream would have broken with its connection.
    timeout(Duration::from_millis(100), watch.message()).await.expect_err("nothing changed");
    strangers.shutdown().await;
}

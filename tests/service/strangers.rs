//! Strangers: connections whose peers have shown no token. They have some seconds, give way to whoever comes, and hold
//! little.

use std::time::{Duration, Instant};

use nappe_proto::v1;
use nappe_server::{App, Config, Limits};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
    task::JoinSet,
    time::{sleep, timeout},
};
use tonic::{Request, Status, Streaming, transport::Channel};
use tonic_health::pb::{HealthCheckRequest, HealthCheckResponse, health_client::HealthClient};

use crate::{
    cloth_scenes::sheet,
    frames::in_time,
    harness::{Server, channel, config, connect, latest},
    raw_calls::outcome,
};

const INFO: &str = "/nappe.v1.SimulationService/GetServerInfo";
const UPLOAD: &str = "/nappe.v1.SimulationService/UploadMesh";
const OPEN: &str = "/nappe.v1.SimulationService/OpenLink";
const CHECK: &str = "/grpc.health.v1.Health/Check";

/// A server with the token that it draws by default, on a free port of loopback.
fn guarded(config: Config) -> App {
    let address = "127.0.0.1:0".parse().expect("an address");
    App::start(Config { address, ..config }).expect("the server starts")
}

/// The beginning of a request of so many bytes.
fn head(path: &str, length: usize) -> String {
    format!(
        "POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/grpc-web+proto\r\n\
         Connection: close\r\nContent-Length: {length}\r\n\r\n"
    )
}

async fn stranger(app: &App) -> TcpStream {
    TcpStream::connect(app.local_addr()).await.expect("the system accepts it")
}

/// Whether the server closes a connection on which it says nothing.
async fn closed(mut stream: TcpStream) -> bool {
    in_time(stream.read(&mut [0; 1])).await.map_or(true, |count| count == 0)
}

/// A connection whose peer showed the token, with a stream that ends with it.
struct Known {
    _channel: Channel,
    stream: Streaming<HealthCheckResponse>,
}

impl Known {
    async fn to(app: &App) -> Result<Self, Status> {
        let channel = channel(app).await;
        let mut request = Request::new(HealthCheckRequest::default());
        let shown = format!("Bearer {}", app.token().expect("a token is the default").reveal());
        request.metadata_mut().insert("authorization", shown.parse().expect("a header"));
        let mut stream = HealthClient::new(channel.clone()).watch(request).await?.into_inner();
        in_time(stream.message()).await?.expect("it says that it serves");
        Ok(Self { _channel: channel, stream })
    }

    /// Whether its connection is still open.
    async fn goes_on(&mut self) -> bool {
        timeout(Duration::from_millis(100), self.stream.message()).await.is_err()
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_oldest_stranger_gives_way_and_whoever_showed_the_token_never_does() {
    let limits = Limits { max_connections_per_address: 3, ..Limits::default() };
    let app = guarded(Config { limits, ..config() });
    let mut first = Known::to(&app).await.expect("it has the token");
    let mut strangers = vec![stranger(&app).await, stranger(&app).await];
    for _ in 0..5 {
        strangers.push(stranger(&app).await);
        assert!(closed(strangers.remove(0)).await);
    }

    // Whoever has the token comes in, however many strangers there are.
    let mut second = Known::to(&app).await.expect("a stranger gives way");
    let mut third = Known::to(&app).await.expect("a stranger gives way");
    for stranger in strangers {
        assert!(closed(stranger).await);
    }
    assert!(closed(stranger(&app).await).await, "nobody is left who could give way");
    assert!(first.goes_on().await && second.goes_on().await && third.goes_on().await);
}

#[tokio::test(flavor = "multi_thread")]
async fn where_no_token_is_asked_for_a_whole_request_makes_known_and_half_a_one_does_not() {
    let limits = Limits { max_connections_per_address: 2, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let id = server.session(sheet(4)).await;
    let mut watch = server.watch(latest(&id)).await;
    watch.frame().await;

    let mut half = stranger(&server.app).await;
    half.write_all(&[head(INFO, 5).as_bytes(), &[0; 3]].concat()).await.expect("sent");
    let mut other = connect(&server.app).await;
    assert!(closed(half).await);
    other.get_server_info(v1::GetServerInfoRequest {}).await.expect("answered");
    assert!(closed(stranger(&server.app).await).await, "nobody is left who could give way");
    // It is the connection that it was: a stream of another one would have broken.
    server.step(&id, 1).await;
    watch.frame().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stranger_has_the_seconds_of_the_handshake_whatever_it_begins() {
    const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
    /// Opens HTTP/2.
    const SETTINGS: &[u8] = b"\0\0\0\x04\0\0\0\0\0";

    let app = guarded(Config { handshake_seconds: 0.5, ..config() });
    let server = app.local_addr();
    let half = [head(OPEN, 500).as_bytes(), b"\0\0\0\x01\xef\x0a"].concat();
    let mut ends = JoinSet::new();
    for beginning in [
        b"".to_vec(),
        PREFACE[..10].to_vec(),
        PREFACE.to_vec(),
        [PREFACE, SETTINGS].concat(),
        b"GET / HTTP/1.1\r\nHost: local".to_vec(),
        b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n".to_vec(),
        half,
    ] {
        ends.spawn(async move {
            let begin = Instant::now();
            let mut stream = TcpStream::connect(server).await.expect("accepted");
            // Where this machine is busy, it may be closed already.
            let _ = stream.write_all(&beginning).await;
            let _ = in_time(stream.read_to_end(&mut Vec::new())).await;
            let text = String::from_utf8_lossy(&beginning).into_owned();
            assert!(begin.elapsed() >= Duration::from_millis(500), "not before its time: {text}");
        });
    }
    ends.join_all().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn whoever_showed_the_token_in_time_stays() {
    let time = Duration::from_secs(1);
    let app = guarded(Config { handshake_seconds: time.as_secs_f64(), ..config() });
    // A busy machine may not let us, and then we try again.
    let mut known = loop {
        let begin = Instant::now();
        match Known::to(&app).await {
            Ok(known) => break known,
            Err(status) => assert!(begin.elapsed() >= time, "{status:?}"),
        }
    };
    sleep(2 * time).await;
    assert!(known.goes_on().await);
}

/// What is answered to a stranger who announces 4 MB and sends little of it.
async fn answered(app: &App, path: &str) -> String {
    let length = 4_000_000;
    let mut stream = stranger(app).await;
    let message = [&[0][..], &(length as u32 - 5).to_be_bytes(), &[0; 100]].concat();
    // At once: between two pieces the server may have answered and closed already.
    stream.write_all(&[head(path, length).as_bytes(), &message].concat()).await.expect("sent");
    let mut answer = Vec::new();
    in_time(stream.read_to_end(&mut answer)).await.expect("read");
    String::from_utf8_lossy(&answer).to_ascii_lowercase()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_body_without_a_token_is_never_waited_for_and_one_that_needs_none_has_a_kibibyte() {
    let app = guarded(config());
    for (path, status) in [(INFO, 16), (UPLOAD, 16), (OPEN, 8), (CHECK, 8)] {
        let answer = answered(&app, path).await;
        assert!(answer.contains(&format!("grpc-status: {status}\r\n")), "{path}: {answer}");
    }

    let stranger = channel(&app).await;
    let refused = "RESOURCE_EXHAUSTED `MESSAGE_TOO_LARGE`";
    for path in [OPEN, CHECK] {
        // The prefix of a message has five bytes.
        for too_long in [1020, 100_000] {
            assert_eq!(outcome(&stranger, path, vec![0; too_long], None).await, refused, "{path}");
        }
        let read = outcome(&stranger, path, vec![0; 1019], None).await;
        assert_eq!(read, "INVALID_ARGUMENT `INVALID_MESSAGE`", "{path}");
    }
}

//! What browsers do: gRPC-Web over HTTP/1.1, byte by byte, and which web pages may call.

use std::{net::SocketAddr, time::Duration};

use base64::{Engine as _, engine::general_purpose::STANDARD_NO_PAD};
use nappe_proto::v1;
use nappe_server::{Config, Reason};
use prost::Message as _;
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
};
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::sheet,
    frames::PATIENCE,
    harness::{Server, config, every},
};

const PAGE: &str = "http://localhost:5173";
const SERVICE: &str = "/nappe.v1.SimulationService";

/// Headers in lower case, and the body without its HTTP chunks.
pub(crate) struct Answer {
    pub(crate) status: u16,
    headers: String,
    body: Vec<u8>,
}

impl Answer {
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        let prefix = format!("{name}:");
        self.headers.lines().find_map(|line| {
            line.to_ascii_lowercase().starts_with(&prefix).then(|| line[prefix.len()..].trim())
        })
    }

    /// The body as it came.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.body
    }

    /// Whether one of the headers of a name has a value among others.
    pub(crate) fn lists(&self, name: &str, value: &str) -> bool {
        let headers = self.headers.to_ascii_lowercase();
        let lists = headers.lines().filter_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
        lists.flat_map(|list| list.split(',')).any(|entry| entry.trim() == value)
    }

    /// The body as a text.
    pub(crate) fn text(&self) -> &str {
        std::str::from_utf8(&self.body).expect("UTF-8")
    }

    /// The first message of an answer that is one.
    pub(crate) fn message<M: prost::Message + Default>(&self) -> M {
        M::decode(unframed(&self.body)[0].1.as_slice()).expect("the message")
    }

    /// The reason in the status details, which stand in the headers when there is no body.
    pub(crate) fn reason(&self) -> String {
        let details = self.header("grpc-status-details-bin").expect("details");
        let details = STANDARD_NO_PAD.decode(details.trim_end_matches('=')).expect("base64");
        let status = tonic::Status::with_details(tonic::Code::Unknown, "", details.into());
        status.get_details_error_info().expect("an ErrorInfo").reason
    }
}

/// Sends a request over HTTP/1.1 and reads its answer.
pub(crate) async fn exchange(
    server: &Server,
    method: &str,
    path: &str,
    headers: &str,
    body: &[u8],
) -> Answer {
    exchange_at(server.app.local_addr(), method, path, headers, body).await
}

/// The same, with a server at an address.
pub(crate) async fn exchange_at(
    server: SocketAddr,
    method: &str,
    path: &str,
    headers: &str,
    body: &[u8],
) -> Answer {
    let headers = format!("Host: localhost\r\n{headers}");
    exchange_bare(server, method, path, &headers, body).await
}

/// The same, without a host besides that of the headers.
pub(crate) async fn exchange_bare(
    server: SocketAddr,
    method: &str,
    path: &str,
    headers: &str,
    body: &[u8],
) -> Answer {
    let mut stream = TcpStream::connect(server).await.expect("accepted");
    let length = body.len();
    let head =
        format!("{method} {path} HTTP/1.1\r\nConnection: close\r\nContent-Length: {length}\r\n{headers}\r\n");
    stream.write_all(head.as_bytes()).await.expect("sent");
    stream.write_all(body).await.expect("sent");
    let mut bytes = Vec::new();
    tokio::time::timeout(PATIENCE, stream.read_to_end(&mut bytes)).await.expect("in time").expect("read");
    let split = bytes.windows(4).position(|w| w == b"\r\n\r\n").expect("an end of headers");
    let headers = String::from_utf8(bytes[..split].to_vec()).expect("ASCII");
    let status = headers.split(' ').nth(1).and_then(|code| code.parse().ok()).expect("a status");
    let body = bytes[split + 4..].to_vec();
    let chunked = headers.to_ascii_lowercase().contains("transfer-encoding: chunked");
    Answer { status, headers, body: if chunked { unchunk(&body) } else { body } }
}

fn unchunk(mut bytes: &[u8]) -> Vec<u8> {
    let mut whole = Vec::new();
    loop {
        let line = bytes.windows(2).position(|w| w == b"\r\n").expect("a size");
        let size = std::str::from_utf8(&bytes[..line]).expect("hexadecimal");
        let size = usize::from_str_radix(size.trim(), 16).expect("hexadecimal");
        if size == 0 {
            return whole;
        }
        whole.extend_from_slice(&bytes[line + 2..line + 2 + size]);
        bytes = &bytes[line + 2 + size + 2..];
    }
}

/// A message with its gRPC prefix: not compressed, length, bytes.
pub(crate) fn framed(message: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0];
    bytes.extend((message.len() as u32).to_be_bytes());
    bytes.extend(message);
    bytes
}

fn unframed(mut bytes: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let mut frames = Vec::new();
    while bytes.len() >= 5 {
        let length = u32::from_be_bytes(bytes[1..5].try_into().expect("four bytes")) as usize;
        frames.push((bytes[0], bytes[5..5 + length].to_vec()));
        bytes = &bytes[5 + length..];
    }
    frames
}

async fn call(server: &Server, path: &str, extra: &str, message: &[u8]) -> Answer {
    let headers = format!("Content-Type: application/grpc-web+proto\r\nX-Grpc-Web: 1\r\n{extra}");
    exchange(server, "POST", path, &headers, &framed(message)).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_browser_calls_over_http_1() {
    let mut server = Server::start().await;
    let origin = format!("Origin: {PAGE}\r\n");
    let answer = call(&server, &format!("{SERVICE}/GetServerInfo"), &origin, &[]).await;
    assert_eq!((answer.status, answer.header("access-control-allow-origin")), (200, Some(PAGE)));
    let frames = unframed(&answer.body);
    let info = v1::GetServerInfoResponse::decode(frames[0].1.as_slice()).expect("the message");
    assert!(info.scenes.iter().any(|scene| scene == "demo"));
    let trailers = String::from_utf8_lossy(&frames[1].1).into_owned();
    assert!(frames[1].0 == 0x80 && trailers.contains("grpc-status:0"), "{trailers}");
    let exposed = answer.header("access-control-expose-headers").expect("exposed headers").to_owned();
    for header in ["grpc-status", "grpc-message", "grpc-status-details-bin"] {
        assert!(exposed.contains(header), "{exposed}");
    }

    // A stream, too: topology, how the session stands, three frames, end, trailers.
    let id = server.session(sheet(3)).await;
    server.step(&id, 2).await;
    server.client.stop_session(v1::StopSessionRequest::of(&id)).await.expect("stopped");
    let request = every(&id, 0).encode_to_vec();
    let answer = call(&server, &format!("{SERVICE}/WatchFrames"), &origin, &request).await;
    let frames = unframed(&answer.body);
    assert_eq!(frames.iter().map(|(flag, _)| *flag).collect::<Vec<_>>(), [0, 0, 0, 0, 0, 0, 0x80]);
}

#[tokio::test(flavor = "multi_thread")]
async fn errors_of_the_framework_carry_a_reason_too() {
    let server = Server::start().await;
    let cases: [(&str, &str, &[u8], Reason); 4] = [
        ("/nappe.v1.SimulationService/Nothing", "", &[], Reason::UnknownMethod),
        ("/some.Other/Method", "", &[], Reason::UnknownMethod),
        ("/nappe.v1.SimulationService/GetSession", "", &[0xff; 7], Reason::InvalidMessage),
        ("/nappe.v1.SimulationService/GetSession", "", &[], Reason::InvalidField),
    ];
    for (path, extra, message, reason) in cases {
        let answer = call(&server, path, extra, message).await;
        assert_eq!(answer.reason(), reason.name(), "{path}: {}", answer.headers);
        let code = (reason.code() as i32).to_string();
        assert_eq!(answer.header("grpc-status"), Some(code.as_str()), "{path}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_deadline_of_a_client_is_kept() {
    let mut server = Server::start().await;
    let session_id = server.session(sheet(8)).await;
    let step = v1::StepSessionRequest {
        step_count: 10_000_000,
        wait: true,
        ..v1::StepSessionRequest::of(session_id)
    };
    let path = format!("{SERVICE}/StepSession");
    let begin = std::time::Instant::now();
    let answer = call(&server, &path, "grpc-timeout: 300m\r\n", &step.encode_to_vec()).await;
    assert_eq!(answer.reason(), Reason::DeadlineExceeded.name());
    assert!(begin.elapsed() >= Duration::from_millis(300));
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_of_other_origins_are_refused() {
    let config = Config { allowed_origins: vec!["https://viewer.example".into()], ..config() };
    let server = Server::configured(config).await;

    let path = format!("{SERVICE}/GetServerInfo");
    for (origin, allowed) in
        [(PAGE, true), ("https://viewer.example", true), ("https://evil.example", false), ("null", false)]
    {
        let preflight = format!(
            "Origin: {origin}\r\nAccess-Control-Request-Method: POST\r\n\
             Access-Control-Request-Headers: content-type,x-grpc-web\r\n"
        );
        let answer = exchange(&server, "OPTIONS", &path, &preflight, &[]).await;
        assert_eq!(answer.header("access-control-allow-origin").is_some(), allowed, "{origin}");
        assert_eq!(answer.header("access-control-allow-credentials"), None, "no cookies, ever");

        let answer = call(&server, &path, &format!("Origin: {origin}\r\n"), &[]).await;
        if allowed {
            assert_eq!(unframed(&answer.body).len(), 2, "{origin}");
        } else {
            assert_eq!(answer.reason(), Reason::OriginNotAllowed.name(), "{origin}");
        }
    }
}

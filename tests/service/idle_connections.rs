//! A connection without calls is closed after a while; one with an open stream is not.

use std::time::{Duration, Instant};

use nappe_proto::v1;
use nappe_server::Config;
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
};

use crate::{
    cloth_scenes::sheet,
    frames::in_time,
    harness::{Server, config, connect, latest},
};

/// Opens HTTP/2 and nothing else.
const OPENING: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0";
/// Types of frames.
const SETTINGS: u8 = 4;
const GOAWAY: u8 = 7;
const WINDOW_UPDATE: u8 = 8;
/// A setting: bytes that a stream may send unasked.
const INITIAL_WINDOW_SIZE: u8 = 4;

/// The type and the content of the next frame; none once the connection is closed.
async fn frame(stream: &mut TcpStream) -> Option<(u8, Vec<u8>)> {
    // Three bytes of length, a type, flags, four bytes of stream.
    let mut head = [0; 9];
    in_time(stream.read_exact(&mut head)).await.ok()?;
    let mut content = vec![0; u32::from_be_bytes([0, head[0], head[1], head[2]]) as usize];
    in_time(stream.read_exact(&mut content)).await.expect("a whole frame");
    Some((head[3], content))
}

async fn impatient() -> Server {
    Server::configured(Config { idle_seconds: 0.5, ..config() }).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_without_calls_is_closed_with_a_farewell() {
    let server = impatient().await;
    let begin = Instant::now();
    let mut silent = TcpStream::connect(server.app.local_addr()).await.expect("accepted");
    silent.write_all(OPENING).await.expect("sent");

    let mut types = Vec::new();
    while let Some((kind, _)) = frame(&mut silent).await {
        types.push(kind);
    }
    assert!(types.contains(&GOAWAY), "{types:?}");
    assert!(begin.elapsed() >= Duration::from_millis(500), "not before its time: {:?}", begin.elapsed());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_is_promised_no_more_room_than_uploads_need() {
    let server = Server::start().await;
    let mut stream = TcpStream::connect(server.app.local_addr()).await.expect("accepted");
    stream.write_all(OPENING).await.expect("sent");
    let (mut per_stream, mut per_connection) = (None, None);
    while per_stream.is_none() || per_connection.is_none() {
        let (kind, content) = frame(&mut stream).await.expect("the connection is open");
        let number = |bytes: &[u8]| u32::from_be_bytes(bytes.try_into().expect("four bytes"));
        match kind {
            SETTINGS => {
                let mut settings = content.chunks_exact(6);
                let window = settings.find(|setting| setting[..2] == [0, INITIAL_WINDOW_SIZE]);
                per_stream = per_stream.or(window.map(|setting| number(&setting[2..])));
            }
            // On top of the 65 535 bytes that every connection begins with.
            WINDOW_UPDATE => per_connection = Some(number(&content) + 65_535),
            _ => {}
        }
    }
    assert_eq!((per_stream, per_connection), (Some(1 << 20), Some(4 << 20)));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_was_idle_calls_again_and_a_watcher_is_never_idle() {
    let mut server = impatient().await;
    let id = server.session(sheet(4)).await;
    let mut watch = server.watch(latest(&id)).await;
    watch.frame().await;

    // Its stream is open, and silent: the session is paused.
    tokio::time::sleep(Duration::from_secs(1)).await;
    let mut other = connect(&server.app).await;
    other
        .step_session(v1::StepSessionRequest { step_count: 3, wait: true, ..v1::StepSessionRequest::of(&id) })
        .await
        .expect("stepped");
    watch.frame().await;

    // A connection of its own, which was closed meanwhile: the next call makes another.
    tokio::time::sleep(Duration::from_secs(1)).await;
    other.get_server_info(v1::GetServerInfoRequest {}).await.expect("called again");
}

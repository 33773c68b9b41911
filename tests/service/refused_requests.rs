//! Requests that the transport refuses before any method sees them: each with a status and a reason.

use nappe_proto::v1;
use nappe_server::Reason;
use tokio_stream::StreamExt as _;
use tonic::{Code, Request};
use tonic_reflection::pb::v1::{
    ServerReflectionRequest, server_reflection_client::ServerReflectionClient,
    server_reflection_request::MessageRequest,
};

use crate::{
    frames::in_time,
    grpc_web::exchange,
    harness::{Server, assert_reason, channel},
};

const INFO: &str = "/nappe.v1.SimulationService/GetServerInfo";

fn info() -> Request<v1::GetServerInfoRequest> {
    Request::new(v1::GetServerInfoRequest {})
}

#[tokio::test(flavor = "multi_thread")]
async fn an_unknown_compression_is_refused_with_what_is_read() {
    let mut server = Server::start().await;
    let mut request = info();
    request.metadata_mut().insert("grpc-encoding", "gzip".parse().expect("a header"));
    let refused = server.client.get_server_info(request).await.expect_err("not read");
    assert_eq!(assert_reason(&refused, Reason::CompressionNotSupported)["encoding"], "gzip");
    assert_eq!(refused.code(), Code::Unimplemented);
    let read = refused.metadata().get("grpc-accept-encoding").expect("what is read");
    assert_eq!(read, "identity");

    let mut request = info();
    request.metadata_mut().insert("grpc-encoding", "identity".parse().expect("a header"));
    server.client.get_server_info(request).await.expect("not compressed");
}

#[tokio::test(flavor = "multi_thread")]
async fn headers_that_are_too_large_are_refused_with_the_limit() {
    let mut server = Server::start().await;
    let mut request = info();
    request.metadata_mut().insert("x-note", "n".repeat(20_000).parse().expect("a header"));
    let refused = server.client.get_server_info(request).await.expect_err("too large");
    assert_eq!(assert_reason(&refused, Reason::HeadersTooLarge)["allowed"], "16384");
    server.client.get_server_info(info()).await.expect("the connection goes on");
}

#[tokio::test(flavor = "multi_thread")]
async fn requests_that_are_no_calls_are_answered_as_http_and_as_grpc() {
    let server = Server::start().await;
    let json = exchange(&server, "POST", INFO, "Content-Type: application/json\r\n", b"{}").await;
    assert_eq!((json.status, json.reason().as_str()), (415, Reason::NotACall.name()));
    let grpc = exchange(&server, "POST", INFO, "Content-Type: application/grpc\r\n", &[0; 5]).await;
    assert_eq!((grpc.status, grpc.reason().as_str()), (415, Reason::NotACall.name()));
    let page = exchange(&server, "GET", "/index.html", "", b"").await;
    assert_eq!((page.status, page.reason().as_str()), (405, Reason::NotACall.name()));
}

#[tokio::test(flavor = "multi_thread")]
async fn errors_of_reflection_have_reasons() {
    let server = Server::start().await;
    let mut reflection = ServerReflectionClient::new(channel(&server.app).await);
    for (question, reason) in [
        (Some(MessageRequest::FileContainingSymbol("some.Other".into())), Reason::UnknownSymbol),
        (Some(MessageRequest::FileByFilename("other.proto".into())), Reason::UnknownSymbol),
        (None, Reason::InvalidMessage),
    ] {
        let request = ServerReflectionRequest { host: String::new(), message_request: question };
        let asked = reflection.server_reflection_info(tokio_stream::once(request)).await;
        let mut answers = asked.expect("a stream").into_inner();
        let answer = in_time(answers.next()).await.expect("an answer");
        assert_reason(&answer.expect_err("not known"), reason);
    }
}

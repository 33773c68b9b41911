//! Health and reflection answer the standard clients.

use nappe_server::Reason;
use tokio_stream::StreamExt as _;
use tonic_health::pb::{
    HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient,
};

use crate::{
    frames::in_time,
    harness::{Server, assert_reason, channel},
};

const SERVICE: &str = "nappe.v1.SimulationService";

#[tokio::test(flavor = "multi_thread")]
async fn health_says_serving_for_the_server_and_the_service() {
    let server = Server::start().await;
    let mut health = HealthClient::new(channel(&server.app).await);
    for service in ["", SERVICE] {
        let request = HealthCheckRequest { service: service.into() };
        let answer = health.check(request).await.expect("known").into_inner();
        assert_eq!(answer.status(), ServingStatus::Serving, "'{service}'");
    }

    let unknown = health.check(HealthCheckRequest { service: "some.Other".into() }).await;
    assert_reason(&unknown.expect_err("not known"), Reason::UnknownService);
}

/// Asks for the services and for the file of one of them, in a version of the protocol.
macro_rules! reflect {
    ($server:expr, $version:ident) => {{
        use tonic_reflection::pb::$version::{
            ServerReflectionRequest, server_reflection_client::ServerReflectionClient,
            server_reflection_request::MessageRequest, server_reflection_response::MessageResponse,
        };
        let mut client = ServerReflectionClient::new(channel(&$server.app).await);
        let questions = [
            MessageRequest::ListServices(String::new()),
            MessageRequest::FileContainingSymbol(SERVICE.into()),
        ];
        let questions = questions
            .map(|question| ServerReflectionRequest { host: String::new(), message_request: Some(question) });
        let answers = client.server_reflection_info(tokio_stream::iter(questions)).await.expect("answers");
        let answers: Vec<_> = in_time(answers.into_inner().collect()).await;
        let mut services = Vec::new();
        let mut file = Vec::new();
        for answer in answers {
            match answer.expect("no error").message_response {
                Some(MessageResponse::ListServicesResponse(list)) => {
                    services.extend(list.service.into_iter().map(|service| service.name));
                }
                Some(MessageResponse::FileDescriptorResponse(files)) => {
                    file.extend(files.file_descriptor_proto);
                }
                other => panic!("not an answer: {other:?}"),
            }
        }
        (services, file)
    }};
}

#[tokio::test(flavor = "multi_thread")]
async fn reflection_tells_the_services_and_their_files_in_both_versions() {
    let server = Server::start().await;
    for (services, file) in [reflect!(server, v1), reflect!(server, v1alpha)] {
        assert!(services.iter().any(|name| name == SERVICE), "{services:?}");
        assert!(services.iter().any(|name| name == "grpc.health.v1.Health"), "{services:?}");
        let text = String::from_utf8_lossy(&file[0]).into_owned();
        assert!(text.contains("WatchFrames"), "the file holds the methods");
    }
}

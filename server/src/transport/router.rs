//! What answers a request: CORS, gRPC-Web, the guard, then the services: simulation, health,
//! reflection (v1 and v1alpha).

use std::{sync::Arc, time::Duration};

use http::{HeaderName, HeaderValue, Method, header};
use hyper::body::Incoming;
use nappe_proto::v1::{FILE_DESCRIPTOR_SET, simulation_service_server::SimulationServiceServer};
use tonic::service::Routes;
use tonic_health::pb::health_server::HealthServer;
use tonic_health::server::{HealthReporter, HealthService};
use tonic_web::GrpcWebLayer;
use tower::{Layer as _, ServiceExt as _, util::BoxCloneSyncService};
use tower_http::cors::{AllowOrigin, CorsLayer};

use super::{cors::Origins, interceptor::Guard, listener::Handler};
use crate::rpc::{Methods, Shared};

/// Headers in which gRPC-Web clients find a call's status.
const STATUS_HEADERS: [&str; 3] = ["grpc-status", "grpc-message", "grpc-status-details-bin"];
/// Headers that gRPC-Web clients send.
const CALL_HEADERS: [&str; 4] = ["x-grpc-web", "x-user-agent", "grpc-timeout", "content-type"];

/// Builds the handler of all requests.
pub(crate) fn router(shared: &Arc<Shared>, health: &HealthReporter) -> Handler {
    let message_bytes = shared.config.limits.max_message_bytes as usize;
    let simulation =
        SimulationServiceServer::new(Methods(Arc::clone(shared))).max_decoding_message_size(message_bytes);
    let health = HealthServer::new(HealthService::from_health_reporter(health.clone()));
    let routes = Routes::new(simulation)
        .add_service(health)
        .add_service(reflection().build_v1().expect("the descriptors were made by the build"))
        .add_service(reflection().build_v1alpha().expect("the descriptors were made by the build"))
        .prepare();
    let origins = Origins::new(&shared.config.allowed_origins);
    let guarded = Guard::new(routes, origins.clone(), shared.draining.clone());
    let service = cors(origins).layer(GrpcWebLayer::new().layer(guarded));
    BoxCloneSyncService::new(service.map_request(|request: http::Request<Incoming>| request))
}

fn reflection() -> tonic_reflection::server::Builder<'static> {
    tonic_reflection::server::Builder::configure()
        .register_encoded_file_descriptor_set(FILE_DESCRIPTOR_SET)
        .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
}

fn cors(origins: Origins) -> CorsLayer {
    let allow = move |origin: &HeaderValue, _: &http::request::Parts| origins.allow(origin);
    CorsLayer::new()
        .allow_origin(AllowOrigin::predicate(allow))
        .allow_methods([Method::POST])
        .allow_headers(CALL_HEADERS.map(HeaderName::from_static))
        .expose_headers(STATUS_HEADERS.map(HeaderName::from_static))
        .vary([header::ORIGIN])
        .max_age(Duration::from_hours(1))
}

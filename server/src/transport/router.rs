//! What answers a request: CORS, gRPC-Web, the interceptor, then the services: simulation, health,
//! reflection (v1 and v1alpha).

use std::sync::Arc;

use hyper::body::Incoming;
use nappe_proto::v1::{FILE_DESCRIPTOR_SET, simulation_service_server::SimulationServiceServer};
use tonic::service::Routes;
use tonic_health::pb::health_server::HealthServer;
use tonic_health::server::{HealthReporter, HealthService};
use tonic_web::GrpcWebLayer;
use tower::{Layer as _, ServiceExt as _, util::BoxCloneSyncService};

use super::{
    cors::{AllowedOrigins, cors_layer},
    host::AllowedHosts,
    interceptor::Interceptor,
    listener::Handler,
    request_deadline::RequestBody,
};
use crate::rpc::{Methods, Shared};

/// Methods whose requests are streams: they end when the client likes.
const STREAMS: [&str; 2] = ["/nappe.v1.SimulationService/UploadMesh", "/grpc.reflection."];

/// Builds the handler of all requests.
pub(crate) fn router(shared: &Arc<Shared>, health: &HealthReporter) -> Handler {
    let message_bytes = shared.config.limits.max_message_bytes as usize;
    let simulation = SimulationServiceServer::new(Methods::new(Arc::clone(shared)))
        .max_decoding_message_size(message_bytes);
    let health = HealthServer::new(HealthService::from_health_reporter(health.clone()));
    let routes = Routes::new(simulation)
        .add_service(health)
        .add_service(reflection().build_v1().expect("the descriptors were made by the build"))
        .add_service(reflection().build_v1alpha().expect("the descriptors were made by the build"))
        .prepare();

    let origins = AllowedOrigins::new(&shared.config.allowed_origins);
    let hosts = AllowedHosts::new(&shared.config.allowed_hosts);
    let intercepted = Interceptor::new(routes, origins.clone(), hosts, shared.draining.clone());
    let service = cors_layer(origins).layer(GrpcWebLayer::new().layer(intercepted));
    let time = shared.config.request_time();
    BoxCloneSyncService::new(service.map_request(move |request: http::Request<Incoming>| {
        let is_stream = STREAMS.iter().any(|prefix| request.uri().path().starts_with(prefix));
        let time = (!is_stream).then_some(time);
        request.map(|body| RequestBody::new(body, time))
    }))
}

fn reflection() -> tonic_reflection::server::Builder<'static> {
    tonic_reflection::server::Builder::configure()
        .register_encoded_file_descriptor_set(FILE_DESCRIPTOR_SET)
        .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
}

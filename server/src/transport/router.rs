//! What answers a request: layer after layer, then the services. CORS, metrics, the page for browsers, what is no call, gRPC-Web,
//! the time in which it arrives, the interceptor; simulation, health, reflection (v1 and v1alpha).

use std::sync::Arc;

use http::Request;
use hyper::body::Incoming;
use nappe_proto::{
    token::Token,
    v1::{FILE_DESCRIPTOR_SET, simulation_service_server::SimulationServiceServer},
};
use tonic::{body::Body, service::Routes};
use tonic_health::pb::health_server::HealthServer;
use tonic_health::server::{HealthReporter, HealthService};
use tonic_web::GrpcWebLayer;
use tower::{
    Layer as _, ServiceExt as _, service_fn,
    util::{BoxCloneSyncService, MapResponseLayer},
};

#[cfg(feature = "page")]
use super::page;
use super::{
    cors::{AllowedOrigins, cors_layer},
    door::Door,
    grpc::no_call,
    guard::{OPEN_BYTES, RequestGuard},
    host::AllowedHosts,
    interceptor::Interceptor,
    listener::Handler,
    method::Method,
    metrics,
    request_deadline::RequestBody,
    token::Guard,
};
use crate::{
    caller::Caller,
    refusals::Call,
    rpc::{Methods, Shared},
    stream::with_frames,
};

/// Builds the handler of all requests, which asks for a token if there is one.
pub(crate) fn router(shared: &Arc<Shared>, health: &HealthReporter, token: Option<Token>) -> Handler {
    let message_bytes = shared.config.limits.max_message_bytes as usize;
    let simulation = SimulationServiceServer::new(Methods::new(Arc::clone(shared)))
        .max_decoding_message_size(message_bytes);
    let health = HealthServer::new(HealthService::from_health_reporter(health.clone()))
        .max_decoding_message_size(OPEN_BYTES as usize);
    let reflection_v1 = reflection().build_v1().expect("the descriptors were made by the build");
    let reflection_v1alpha = reflection().build_v1alpha().expect("the descriptors were made by the build");
    let routes = Routes::new(simulation)
        .add_service(health)
        .add_service(reflection_v1.max_decoding_message_size(message_bytes))
        .add_service(reflection_v1alpha.max_decoding_message_size(message_bytes))
        .prepare();
    let routes = MapResponseLayer::new(with_frames).layer(routes);

    let origins = AllowedOrigins::new(&shared.config.allowed_origins);
    let hosts = AllowedHosts::new(&shared.config.address, &shared.config.allowed_hosts);
    let max_elements = shared.config.limits.max_changes_per_call.into();
    let guarded = RequestGuard::new(routes, Arc::clone(&shared.requests), max_elements);
    let door = Door::new(origins.clone(), hosts, Guard::new(token, Arc::clone(&shared.passes)));
    let intercepted = Interceptor::new(guarded, door.clone(), shared.draining.clone());
    let time = shared.config.request_time();
    let draining = shared.draining.clone();
    let timed = intercepted.map_request(move |request: Request<Body>| {
        let method = Method::new(request.uri().path());
        let time = (!method.takes_a_stream()).then_some(time);
        request.map(|body| {
            let body = RequestBody::new(body, time);
            // Ours end by themselves, and whether the server serves is answered until the end.
            let is_cut = !method.is_simulation() && !method.is_health_check();
            Body::new(if is_cut { body.until(&draining) } else { body })
        })
    });
    let calls = GrpcWebLayer::new().layer(timed);
    let shared = Arc::clone(shared);
    let calls = service_fn(move |mut request: Request<Incoming>| {
        let call = Call::new(Caller::of(request.extensions()), &shared.refusals);
        request.extensions_mut().insert(call);
        let calls = calls.clone();
        let answer = metrics::answer(&request, &door, &shared);
        #[cfg(feature = "page")]
        let answer = answer.or_else(|| page::answer(&request, &door));
        let answer = answer.or_else(|| no_call(&request));
        async move {
            match answer {
                Some(answer) => Ok(answer),
                None => calls.oneshot(request).await,
            }
        }
    });
    BoxCloneSyncService::new(cors_layer(origins).layer(calls))
}

fn reflection() -> tonic_reflection::server::Builder<'static> {
    tonic_reflection::server::Builder::configure()
        .register_encoded_file_descriptor_set(FILE_DESCRIPTOR_SET)
        .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
}

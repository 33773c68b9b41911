//! Requests that are no calls: wrong methods of HTTP, and content that is not gRPC's. They are answered as the
//! specification of gRPC asks, with 405 or 415 of HTTP, and with a reason as everything else.

use http::{Method, Request, Response, StatusCode, Version, header};
use tonic::body::Body;

use super::interceptor::refused;
use crate::{
    error::{Reason, ServiceError},
    refusals::Call,
};

/// Content of gRPC, which needs HTTP/2.
const GRPC: &str = "application/grpc";
/// Content of gRPC-Web.
const GRPC_WEB: [&str; 4] = [
    "application/grpc-web",
    "application/grpc-web+proto",
    "application/grpc-web-text",
    "application/grpc-web-text+proto",
];

/// The answer to a request that is no call; none if it is one.
pub(super) fn no_call<B>(request: &Request<B>) -> Option<Response<Body>> {
    let content = request.headers().get(header::CONTENT_TYPE);
    let content = content.map(|value| String::from_utf8_lossy(value.as_bytes())).unwrap_or_default();
    let is_web = GRPC_WEB.contains(&&*content);

    let (status, message) = if request.method() != Method::POST {
        let method = request.method();
        (StatusCode::METHOD_NOT_ALLOWED, format!("the method of HTTP is {method}; calls are POST requests"))
    } else if is_web || (content.starts_with(GRPC) && request.version() == Version::HTTP_2) {
        return None;
    } else {
        let message = format!(
            "the content type is '{content}'; allowed: {GRPC} over HTTP/2, {} over any version",
            GRPC_WEB.join(", ")
        );
        (StatusCode::UNSUPPORTED_MEDIA_TYPE, message)
    };
    let refusal = ServiceError::new(Reason::NotACall, message);
    let mut response = refused(refusal, &Call::of(request.extensions()));
    *response.status_mut() = status;
    Some(response)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_are_posts_of_grpc_or_grpc_web() {
        let status = |method: &str, version, content: &str| {
            let request = Request::builder().method(method).version(version);
            let request = request.header(header::CONTENT_TYPE, content).body(()).expect("a request");
            no_call(&request).map(|response| response.status().as_u16())
        };
        let (http_1, http_2) = (Version::HTTP_11, Version::HTTP_2);
        assert_eq!(status("POST", http_2, "application/grpc"), None);
        assert_eq!(status("POST", http_2, "application/grpc+proto"), None);
        assert_eq!(status("POST", http_2, "application/grpc-web"), None);
        assert_eq!(status("POST", http_1, "application/grpc-web-text+proto"), None);
        assert_eq!(status("POST", http_1, "application/grpc"), Some(415), "HTTP/1.1 has no trailers to read");
        assert_eq!(status("POST", http_2, "application/json"), Some(415));
        assert_eq!(status("POST", http_2, ""), Some(415));
        assert_eq!(status("GET", http_2, "application/grpc"), Some(405));
    }
}

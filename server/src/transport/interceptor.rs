//! The interceptor of every call: whatever happens inside, an error leaves with a reason.
//!
//! Refuses calls while draining, from unknown web origins and to other hosts, honours the client's deadline, turns
//! a panic of a handler into INTERNAL, and gives a reason to statuses that the framework made
//! (unknown method, message too large, message that cannot be decoded).

use std::{
    any::Any,
    convert::Infallible,
    future::{Future, poll_fn},
    panic::{AssertUnwindSafe, catch_unwind},
    pin::pin,
    task::{Context, Poll},
    time::Duration,
};

use http::{HeaderMap, Request, Response};
use tokio_util::sync::CancellationToken;
use tonic::{Code, Status, body::Body};
use tower::Service;

use super::{cors::AllowedOrigins, host::AllowedHosts};
use crate::error::{Reason, ServiceError, panic_message};

/// Prefix of the health service's paths, which answer until the end.
const HEALTH: &str = "/grpc.health.v1.Health/";

/// A service whose every answer carries a reason if it is an error.
#[derive(Clone, Debug)]
pub(super) struct Interceptor<S> {
    inner: S,
    origins: AllowedOrigins,
    hosts: AllowedHosts,
    draining: CancellationToken,
}

impl<S> Interceptor<S> {
    pub(super) fn new(
        inner: S,
        origins: AllowedOrigins,
        hosts: AllowedHosts,
        draining: CancellationToken,
    ) -> Self {
        Self { inner, origins, hosts, draining }
    }

    fn refusal<B>(&self, request: &Request<B>) -> Option<ServiceError> {
        if let Err(host) = self.hosts.check(request) {
            let message = format!("requests to the host '{host}' are not for this server");
            return Some(ServiceError::new(Reason::HostNotAllowed, message).with("host", host));
        }

        if let Some(origin) = request.headers().get(http::header::ORIGIN)
            && !self.origins.allow(origin)
        {
            let origin = String::from_utf8_lossy(origin.as_bytes()).into_owned();
            let message = format!("web pages of the origin '{origin}' may not call this server");
            return Some(ServiceError::new(Reason::OriginNotAllowed, message).with("origin", origin));
        }

        let draining = self.draining.is_cancelled() && !request.uri().path().starts_with(HEALTH);
        draining.then(ServiceError::draining)
    }
}

impl<S, B> Service<Request<B>> for Interceptor<S>
where
    S: Service<Request<B>, Response = Response<Body>, Error = Infallible> + Clone + Send + 'static,
    S::Future: Send,
    B: Send + 'static,
{
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = std::pin::Pin<Box<dyn Future<Output = Result<Self::Response, Infallible>> + Send>>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        self.inner.poll_ready(context)
    }

    fn call(&mut self, request: Request<B>) -> Self::Future {
        if let Some(refusal) = self.refusal(&request) {
            return Box::pin(async move { Ok(Status::from(refusal).into_http()) });
        }

        // The service that was polled ready is the one to call.
        let ready = self.inner.clone();
        let mut inner = std::mem::replace(&mut self.inner, ready);

        let deadline = deadline(request.headers());
        let path = request.uri().path().to_owned();
        Box::pin(async move {
            let answer = without_panic(async move { inner.call(request).await });
            let answer = match deadline {
                None => answer.await,
                Some(deadline) => match tokio::time::timeout(deadline, answer).await {
                    Ok(answer) => answer,
                    Err(_elapsed) => return Ok(Status::from(too_late(deadline)).into_http()),
                },
            };

            Ok(match answer {
                Ok(Ok(response)) => with_reason(response, &path),
                Ok(Err(never)) => match never {},
                Err(panic) => Status::from(panicked(panic.as_ref(), &path)).into_http(),
            })
        })
    }
}

/// Runs a future; a panic in it becomes an error.
async fn without_panic<F: Future>(future: F) -> Result<F::Output, Box<dyn Any + Send>> {
    let mut future = pin!(future);
    poll_fn(|context| match catch_unwind(AssertUnwindSafe(|| future.as_mut().poll(context))) {
        Ok(Poll::Ready(output)) => Poll::Ready(Ok(output)),
        Ok(Poll::Pending) => Poll::Pending,
        Err(panic) => Poll::Ready(Err(panic)),
    })
    .await
}

fn panicked(panic: &(dyn Any + Send), path: &str) -> ServiceError {
    tracing::error!(path, "a call panicked: {}", panic_message(panic));
    ServiceError::internal(format!("the call {path} panicked: this is a bug in the server"))
}

fn too_late(deadline: Duration) -> ServiceError {
    let seconds = deadline.as_secs_f64();
    let message = format!("the call did not end within the client's deadline of {seconds} s");
    ServiceError::new(Reason::DeadlineExceeded, message).with("seconds", seconds)
}

/// Gives a reason to an error that the framework made. Errors at the end of a stream are in its
/// trailers, which only the service's own code writes.
fn with_reason(response: Response<Body>, path: &str) -> Response<Body> {
    let Some(status) = Status::from_header_map(response.headers()) else {
        return response;
    };
    if status.code() == Code::Ok || !status.details().is_empty() {
        return response;
    }

    let message = status.message();
    let error = match status.code() {
        Code::Unimplemented if message.is_empty() => {
            ServiceError::new(Reason::UnknownMethod, format!("there is no method {path}"))
                .with("method", path)
        }
        Code::NotFound => ServiceError::new(Reason::UnknownService, message),
        Code::OutOfRange | Code::ResourceExhausted => ServiceError::new(Reason::MessageTooLarge, message),
        Code::DeadlineExceeded => ServiceError::new(Reason::DeadlineExceeded, message),
        Code::Cancelled => ServiceError::new(Reason::RequestCancelled, message),
        _ => ServiceError::new(Reason::InvalidMessage, message),
    };
    Status::from(error).into_http()
}

/// The client's deadline, from `grpc-timeout`: up to eight digits and a unit. One that cannot be
/// read is ignored, as the specification's reference implementations do.
fn deadline(headers: &HeaderMap) -> Option<Duration> {
    let text = headers.get("grpc-timeout")?.to_str().ok()?;
    let (digits, unit) = text.split_at_checked(text.len().checked_sub(1)?)?;
    if digits.is_empty() || digits.len() > 8 || !digits.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }

    let value: u64 = digits.parse().ok()?;
    Some(match unit {
        "H" => Duration::from_secs(value * 3600),
        "M" => Duration::from_secs(value * 60),
        "S" => Duration::from_secs(value),
        "m" => Duration::from_millis(value),
        "u" => Duration::from_micros(value),
        "n" => Duration::from_nanos(value),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadlines_are_read_as_the_specification_says() {
        let read = |text: &str| {
            let mut headers = HeaderMap::new();
            headers.insert("grpc-timeout", text.parse().expect("a header"));
            deadline(&headers)
        };
        assert_eq!(read("250m"), Some(Duration::from_millis(250)));
        assert_eq!(read("2H"), Some(Duration::from_hours(2)));
        assert_eq!(read("99999999S"), Some(Duration::from_secs(99_999_999)));
        for bad in ["", "S", "123456789S", "5", "5x", "-5S", "+5S", "5é"] {
            assert_eq!(bad.parse::<http::HeaderValue>().ok().and_then(|_| read(bad)), None, "{bad}");
        }
    }

    #[tokio::test]
    async fn a_panic_in_a_future_is_an_error() {
        let panic = without_panic(async { panic!("on purpose") }).await;
        let panic: Box<dyn Any + Send> = match panic {
            Ok(()) => unreachable!("it panics"),
            Err(panic) => panic,
        };
        assert_eq!(panicked(panic.as_ref(), "/x").reason, Reason::Internal);
    }
}

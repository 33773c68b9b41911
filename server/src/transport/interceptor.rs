//! The interceptor of every call: whatever happens inside, an error leaves with a reason.
//!
//! Refuses calls while draining, without the token, from unknown web origins, to other hosts and in forms that are not read, honours
//! the client's deadline, ends calls that wait when the server drains, turns a panic of a handler into INTERNAL,
//! and gives a reason to statuses that the framework made (unknown method, message too large, message that
//! cannot be decoded). Every error that leaves is counted, and the log is told of it.

use std::{
    any::Any,
    convert::Infallible,
    future::{Future, poll_fn},
    panic::{AssertUnwindSafe, catch_unwind},
    pin::pin,
    task::{Context, Poll},
    time::Duration,
};

use http::{HeaderMap, HeaderValue, Request, Response};
use tokio_util::sync::CancellationToken;
use tonic::{Status, body::Body};
use tower::Service;

use super::{
    answer::{Answer, own_reason, reason_for},
    door::Door,
    method::Method,
};
use crate::{
    error::{Reason, ServiceError, panic_message},
    passes::{self, Visitor},
    refusals::Call,
};

/// Most bytes of a request's headers, counted as HTTP/2 does: names, values, and 32 for each.
const HEADER_BYTES: usize = 16 << 10;
/// How messages may be compressed: not at all.
const ENCODINGS: HeaderValue = HeaderValue::from_static("identity");

/// A service whose every answer carries a reason if it is an error.
#[derive(Clone, Debug)]
pub(super) struct Interceptor<S> {
    inner: S,
    door: Door,
    draining: CancellationToken,
}

impl<S> Interceptor<S> {
    pub(super) fn new(inner: S, door: Door, draining: CancellationToken) -> Self {
        Self { inner, door, draining }
    }

    fn admit<B>(&self, request: &Request<B>, method: &Method) -> Result<Visitor, ServiceError> {
        let visitor = self.door.admit(request, method)?;
        let unread = too_large(request.headers()).or_else(|| compressed(request.headers()));
        let draining = self.draining.is_cancelled() && !method.is_health_check();
        let refusal = unread.or_else(|| draining.then(ServiceError::draining));
        refusal.map_or(Ok(visitor), Err)
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

    fn call(&mut self, mut request: Request<B>) -> Self::Future {
        let (method, call) = (Method::new(request.uri().path()), Call::of(request.extensions()));
        let visitor = match self.admit(&request, &method) {
            Ok(visitor) => visitor,
            Err(refusal) => return Box::pin(async move { Ok(refused(refusal, &call)) }),
        };
        let over = visitor.ended();
        request.extensions_mut().insert(visitor);

        // The service that was polled ready is the one to call.
        let ready = self.inner.clone();
        let mut inner = std::mem::replace(&mut self.inner, ready);

        let deadline = deadline(request.headers());
        let draining = self.draining.clone();
        Box::pin(async move {
            let answer = without_panic(async move { inner.call(request).await });
            // Whoever asks whether the server serves is answered until the end.
            let cut = if method.is_health_check() { CancellationToken::new() } else { draining.clone() };
            Ok(match in_time(answer, deadline, &cut, over.as_ref()).await {
                Ok(Ok(Ok(response))) => finished(response, method, call, &draining, over),
                Ok(Ok(Err(never))) => match never {},
                Ok(Err(panic)) => refused(panicked(panic.as_ref(), method.path()), &call),
                Err(cut) => refused(cut, &call),
            })
        })
    }
}

/// Waits for an answer as long as the client does, the server runs, and a pass of the caller is not over: a call may wait for a
/// step of minutes.
async fn in_time<T>(
    answer: impl Future<Output = T>,
    deadline: Option<Duration>,
    draining: &CancellationToken,
    over: Option<&CancellationToken>,
) -> Result<T, ServiceError> {
    let over = async {
        match over {
            None => std::future::pending().await,
            Some(over) => over.cancelled().await,
        }
    };
    let late = async {
        match deadline {
            None => std::future::pending().await,
            Some(deadline) => {
                tokio::time::sleep(deadline).await;
                deadline
            }
        }
    };
    tokio::select! {
        biased;
        answer = answer => Ok(answer),
        deadline = late => Err(too_late(deadline)),
        () = draining.cancelled() => Err(ServiceError::draining()),
        () = over => Err(passes::over()),
    }
}

/// An answer whose errors have reasons, in its headers and at its end.
fn finished(
    response: Response<Body>,
    method: Method,
    call: Call,
    draining: &CancellationToken,
    over: Option<CancellationToken>,
) -> Response<Body> {
    if let Some(error) = reason_for(response.headers(), &method) {
        return refused(error, &call);
    }
    if let Some(reason) = own_reason(response.headers()) {
        call.refused(reason);
    }
    response.map(|body| Body::new(Answer::new(body, method, call, draining).until(over)))
}

/// The answer that is an error and nothing else; the log is told of it.
pub(super) fn refused(error: ServiceError, call: &Call) -> Response<Body> {
    call.refused(error.reason);
    let is_compressed = error.reason == Reason::CompressionNotSupported;
    let mut response = Status::from(error).into_http();
    if is_compressed {
        response.headers_mut().insert("grpc-accept-encoding", ENCODINGS);
    }
    response
}

/// Why headers are too large, if they are.
pub(super) fn too_large(headers: &HeaderMap) -> Option<ServiceError> {
    let bytes: usize = headers.iter().map(|(name, value)| name.as_str().len() + value.len() + 32).sum();
    (bytes > HEADER_BYTES).then(|| {
        let message = format!("the headers have {bytes} bytes; allowed: at most {HEADER_BYTES}");
        ServiceError::new(Reason::HeadersTooLarge, message).with("bytes", bytes).with("allowed", HEADER_BYTES)
    })
}

fn compressed(headers: &HeaderMap) -> Option<ServiceError> {
    let encoding = headers.get("grpc-encoding").filter(|encoding| **encoding != ENCODINGS)?;
    let encoding = String::from_utf8_lossy(encoding.as_bytes()).into_owned();
    let message = format!("messages compressed with '{encoding}' are not read; allowed: identity");
    let error = ServiceError::new(Reason::CompressionNotSupported, message);
    Some(error.with("encoding", encoding).with("allowed", "identity"))
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

//! The memory of a request is bounded while it arrives and until it is answered: its bytes are counted against those
//! of all requests in progress, and its elements before they are decoded. One that needs no token may be of a stranger, and
//! has little.

use std::{
    convert::Infallible,
    future::Future,
    pin::Pin,
    sync::Arc,
    task::{Context, Poll, ready},
};

use bytes::Bytes;
use http::{Request, Response};
use hyper::body::{Body as HttpBody, Frame, SizeHint};
use tonic::{Status, body::Body};
use tower::Service;

use super::{
    connections::Standing,
    elements::{ElementCounter, Fault},
    method::Method,
};
use crate::{
    error::{Reason, ServiceError},
    memory::{Claim, MemoryAccount},
};

/// Methods whose elements are changes.
const CHANGES: [&str; 2] =
    ["/nappe.v1.SimulationService/UpdateParameters", "/nappe.v1.SimulationService/StepSession"];
/// The method that claims the memory of what comes by itself.
const UPLOAD: &str = "/nappe.v1.SimulationService/UploadMesh";
/// Bytes of a request that needs no token, at most: it has a code, or the name of a service.
pub(super) const OPEN_BYTES: u64 = 1 << 10;

/// A service whose requests are counted.
#[derive(Clone, Debug)]
pub(super) struct RequestGuard<S> {
    inner: S,
    /// Bytes of requests in progress.
    account: Arc<MemoryAccount>,
    /// Elements of one request at most.
    max_elements: u64,
}

impl<S> RequestGuard<S> {
    pub(super) fn new(inner: S, account: Arc<MemoryAccount>, max_elements: u64) -> Self {
        Self { inner, account, max_elements }
    }
}

impl<S, B> Service<Request<B>> for RequestGuard<S>
where
    S: Service<Request<GuardedBody<B>>, Response = Response<Body>, Error = Infallible>,
    S::Future: Send + 'static,
{
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Self::Response, Infallible>> + Send>>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        self.inner.poll_ready(context)
    }

    fn call(&mut self, request: Request<B>) -> Self::Future {
        let method = Method::new(request.uri().path());
        let standing = Standing::of(request.extensions());
        if method.takes_a_stream() {
            // Nobody waits for its end.
            standing.becomes_known();
        }
        let room = method.needs_no_token().then_some(OPEN_BYTES);

        let path = method.path();
        let claim = (path != UPLOAD).then(|| Arc::new(self.account.claim()));
        let too_many = if CHANGES.contains(&path) { Reason::TooManyChanges } else { Reason::InvalidMessage };
        let elements = ElementCounter::of(path, self.max_elements);
        let elements = elements.map(|elements| elements.up_to(room.unwrap_or(u64::MAX)));

        // What was decoded lives until the answer.
        let held = claim.clone();
        let allowed = self.max_elements;
        let request = request.map(|inner| {
            let is_refused = false;
            GuardedBody { inner, room, standing, claim, elements, too_many, allowed, is_refused }
        });
        let answer = self.inner.call(request);
        Box::pin(async move {
            let answer = answer.await;
            drop(held);
            answer
        })
    }
}

/// A body whose bytes and elements are counted.
#[derive(Debug)]
pub(super) struct GuardedBody<B> {
    inner: B,
    /// Bytes that may still come of a request that needs no token.
    room: Option<u64>,
    standing: Standing,
    claim: Option<Arc<Claim>>,
    /// None for a method that is not of this contract.
    elements: Option<ElementCounter>,
    /// The reason of too many elements.
    too_many: Reason,
    /// Elements of one message at most.
    allowed: u64,
    is_refused: bool,
}

impl<B> GuardedBody<B> {
    fn check(&mut self, bytes: &[u8]) -> Result<(), ServiceError> {
        let length = bytes.len() as u64;
        if let Some(room) = &mut self.room {
            *room = room.checked_sub(length).ok_or_else(too_long)?;
        }
        if let Some(claim) = &self.claim {
            claim.grow(length)?;
        }
        let read = self.elements.as_mut().map_or(Ok(()), |elements| elements.read(bytes));
        read.map_err(|fault| match fault {
            Fault::TooMany => {
                let allowed = self.allowed;
                let message = format!("the request has more elements than are allowed in one: {allowed}");
                ServiceError::new(self.too_many, message).with("allowed", allowed)
            }
            Fault::TooLong => too_long(),
            Fault::Malformed => {
                ServiceError::new(Reason::InvalidMessage, "the request is not a message of the method")
            }
        })
    }

    /// Whoever sent a whole request is known, where no token is asked for: elsewhere it was shown, unless none is needed.
    fn end(&self) {
        if self.room.is_none() {
            self.standing.becomes_known();
        }
    }
}

fn too_long() -> ServiceError {
    let message = format!("the request has more bytes than one that needs no token may have: {OPEN_BYTES}");
    ServiceError::new(Reason::MessageTooLarge, message).with("allowed", OPEN_BYTES)
}

impl<B> HttpBody for GuardedBody<B>
where
    B: HttpBody<Data = Bytes> + Unpin,
    B::Error: Into<Box<dyn std::error::Error + Send + Sync>>,
{
    type Data = Bytes;
    type Error = Box<dyn std::error::Error + Send + Sync>;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        if self.is_refused {
            return Poll::Ready(None);
        }
        let frame = match ready!(Pin::new(&mut self.inner).poll_frame(context)) {
            None => {
                self.end();
                return Poll::Ready(None);
            }
            Some(Err(error)) => return Poll::Ready(Some(Err(error.into()))),
            Some(Ok(frame)) => frame,
        };

        let checked = frame.data_ref().map_or(Ok(()), |bytes| self.check(bytes));
        Poll::Ready(Some(match checked {
            Ok(()) => Ok(frame),
            Err(refused) => {
                self.is_refused = true;
                Err(Status::from(refused).into())
            }
        }))
    }

    fn is_end_stream(&self) -> bool {
        self.inner.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.inner.size_hint()
    }
}

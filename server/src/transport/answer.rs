//! The body of an answer, looked at on its way out: an error at its end carries a reason, and a stream
//! that knows nothing of a drain is ended by one. That of the bearer of a pass ends with the pass.

use std::{
    future::Future as _,
    pin::Pin,
    task::{Context, Poll},
};

use bytes::Bytes;
use http::HeaderMap;
use hyper::body::{Body as HttpBody, Frame, SizeHint};
use tokio_util::sync::{CancellationToken, WaitForCancellationFutureOwned};
use tonic::{Code, Status, body::Body};
use tonic_types::StatusExt as _;

use super::method::Method;
use crate::{
    error::{Reason, ServiceError},
    passes,
    refusals::Call,
};

/// A body whose errors have reasons.
#[derive(Debug)]
pub(super) struct Answer {
    inner: Body,
    method: Method,
    call: Call,
    /// For streams of services that are not ours: ours end by themselves, with what their watchers must know.
    drained: Option<Pin<Box<WaitForCancellationFutureOwned>>>,
    /// The end of the pass of who called.
    over: Option<Pin<Box<WaitForCancellationFutureOwned>>>,
    has_ended: bool,
}

impl Answer {
    /// The body of an answer to a call of `method`.
    pub(super) fn new(inner: Body, method: Method, call: Call, draining: &CancellationToken) -> Self {
        let ends_itself = method.is_simulation() || method.is_health_check();
        let drained = (!ends_itself).then(|| Box::pin(draining.clone().cancelled_owned()));
        Self { inner, method, call, drained, over: None, has_ended: false }
    }

    /// The same, ended when the pass of who called is over.
    pub(super) fn until(self, over: Option<CancellationToken>) -> Self {
        Self { over: over.map(|over| Box::pin(over.cancelled_owned())), ..self }
    }

    /// Whether a drain ends the stream now.
    fn is_drained(&mut self, context: &mut Context<'_>) -> bool {
        self.drained.as_mut().is_some_and(|drained| drained.as_mut().poll(context).is_ready())
    }

    /// The end of a stream that a drain ends.
    fn drain(&mut self) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        self.end(ServiceError::draining())
    }

    fn end(&mut self, why: ServiceError) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        self.has_ended = true;
        Poll::Ready(Some(Ok(Frame::trailers(trailers(why)))))
    }
}

impl HttpBody for Answer {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        if self.has_ended {
            return Poll::Ready(None);
        }
        if self.over.as_mut().is_some_and(|over| over.as_mut().poll(context).is_ready()) {
            let why = passes::over();
            self.call.refused(why.reason);
            return self.end(why);
        }

        // What is there is sent first: a watcher of health learns that the server no longer serves. The end is ours: the
        // stream may have ended because its requests did, as those of a connection that closes do.
        if let Poll::Ready(frame) = Pin::new(&mut self.inner).poll_frame(context) {
            let is_end = frame.as_ref().is_none_or(|frame| frame.as_ref().is_ok_and(Frame::is_trailers));
            if is_end && self.is_drained(context) {
                return self.drain();
            }
            let frame = frame.map(|frame| frame.map(|frame| reasoned(frame, &self.method, &self.call)));
            return Poll::Ready(frame);
        }
        if self.is_drained(context) { self.drain() } else { Poll::Pending }
    }

    fn is_end_stream(&self) -> bool {
        self.has_ended || self.inner.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.inner.size_hint()
    }
}

/// A frame whose status, if it is an error, has a reason. One that has it already is that of a watcher, which was told of.
fn reasoned(frame: Frame<Bytes>, method: &Method, call: &Call) -> Frame<Bytes> {
    match frame.into_trailers() {
        Err(data) => data,
        Ok(headers) => match reason_for(&headers, method) {
            None => Frame::trailers(headers),
            Some(error) => {
                call.refused(error.reason);
                Frame::trailers(trailers(error))
            }
        },
    }
}

/// The error in headers or trailers that the framework made, with a reason; none if all is well, or our
/// own code gave one.
pub(super) fn reason_for(headers: &HeaderMap, method: &Method) -> Option<ServiceError> {
    let status = Status::from_header_map(headers)?;
    if status.code() == Code::Ok || !status.details().is_empty() {
        return None;
    }

    let message = status.message();
    Some(match status.code() {
        Code::Unimplemented if message.is_empty() => {
            let path = method.path();
            ServiceError::new(Reason::UnknownMethod, format!("there is no method {path}"))
                .with("method", path)
        }
        Code::NotFound if method.is_reflection() => ServiceError::new(Reason::UnknownSymbol, message),
        Code::NotFound => ServiceError::new(Reason::UnknownService, message),
        Code::OutOfRange | Code::ResourceExhausted => ServiceError::new(Reason::MessageTooLarge, message),
        Code::DeadlineExceeded => ServiceError::new(Reason::DeadlineExceeded, message),
        Code::Cancelled => ServiceError::new(Reason::RequestCancelled, message),
        _ => ServiceError::new(Reason::InvalidMessage, message),
    })
}

/// The reason in headers of an answer that our own code refused.
pub(super) fn own_reason(headers: &HeaderMap) -> Option<Reason> {
    let info = Status::from_header_map(headers)?.get_details_error_info()?;
    Reason::of(&info.reason)
}

fn trailers(error: ServiceError) -> HeaderMap {
    let mut headers = HeaderMap::new();
    // Our own texts are made printable, and fit into headers.
    let written = Status::from(error).add_header(&mut headers);
    debug_assert!(written.is_ok(), "a status that fits into headers");
    headers
}

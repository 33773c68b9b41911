//! A request's body that must arrive whole in time: whoever sends a message byte by byte holds memory and a
//! place among the calls, and must not hold them for ever.

use std::{
    future::Future as _,
    pin::Pin,
    task::{Context, Poll},
    time::Duration,
};

use bytes::Bytes;
use hyper::body::{Body as HttpBody, Frame, SizeHint};
use tokio::time::{Sleep, sleep};
use tokio_util::sync::{CancellationToken, WaitForCancellationFutureOwned};
use tonic::{Status, body::Body};

use crate::error::{Reason, ServiceError};

/// A body that fails when it has not ended in time, or when the server drains.
#[derive(Debug)]
pub(super) struct RequestBody {
    inner: Body,
    /// None for an upload, which has limits of its own.
    deadline: Option<(Duration, Pin<Box<Sleep>>)>,
    /// For requests that a service waits for without end.
    drained: Option<Pin<Box<WaitForCancellationFutureOwned>>>,
}

impl RequestBody {
    /// A body that has to end within `time` from now; `None`: whenever it likes.
    pub(super) fn new(inner: Body, time: Option<Duration>) -> Self {
        Self { inner, deadline: time.map(|time| (time, Box::pin(sleep(time)))), drained: None }
    }

    /// The same, ended when the server drains.
    pub(super) fn until(self, draining: &CancellationToken) -> Self {
        Self { drained: Some(Box::pin(draining.clone().cancelled_owned())), ..self }
    }
}

impl HttpBody for RequestBody {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        if let Poll::Ready(frame) = Pin::new(&mut self.inner).poll_frame(context) {
            return Poll::Ready(frame);
        }
        if let Some(drained) = &mut self.drained
            && drained.as_mut().poll(context).is_ready()
        {
            self.drained = None;
            return Poll::Ready(Some(Err(ServiceError::draining().into())));
        }
        let Some((time, sleep)) = &mut self.deadline else { return Poll::Pending };
        if sleep.as_mut().poll(context).is_pending() {
            return Poll::Pending;
        }
        let status: Status = too_slow(*time).into();
        self.deadline = None;
        Poll::Ready(Some(Err(status)))
    }

    fn is_end_stream(&self) -> bool {
        self.inner.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.inner.size_hint()
    }
}

fn too_slow(time: Duration) -> ServiceError {
    let seconds = time.as_secs_f64();
    let message = format!("the request did not arrive whole within {seconds} s");
    ServiceError::new(Reason::RequestTooSlow, message).with("seconds", seconds)
}

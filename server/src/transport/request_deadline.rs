//! A request's body that must arrive whole in time: whoever sends a message byte by byte holds memory and a
//! place among the calls, and must not hold them for ever.

use std::{
    future::Future as _,
    pin::Pin,
    task::{Context, Poll},
    time::Duration,
};

use bytes::Bytes;
use hyper::body::{Body, Frame, Incoming, SizeHint};
use tokio::time::{Sleep, sleep};
use tonic::Status;

use crate::error::{Reason, ServiceError};

/// A body that fails when it has not ended in time.
#[derive(Debug)]
pub(crate) struct RequestBody {
    inner: Incoming,
    /// None for an upload, which has limits of its own.
    deadline: Option<(Duration, Pin<Box<Sleep>>)>,
}

impl RequestBody {
    /// A body that has to end within `time` from now; `None`: whenever it likes.
    pub(super) fn new(inner: Incoming, time: Option<Duration>) -> Self {
        Self { inner, deadline: time.map(|time| (time, Box::pin(sleep(time)))) }
    }
}

impl Body for RequestBody {
    type Data = Bytes;
    type Error = Box<dyn std::error::Error + Send + Sync>;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        let frame = Pin::new(&mut self.inner).poll_frame(context);
        if let Poll::Ready(frame) = frame {
            return Poll::Ready(frame.map(|frame| frame.map_err(Into::into)));
        }
        let Some((time, sleep)) = &mut self.deadline else { return Poll::Pending };
        if sleep.as_mut().poll(context).is_pending() {
            return Poll::Pending;
        }
        let status: Status = too_slow(*time).into();
        self.deadline = None;
        Poll::Ready(Some(Err(status.into())))
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

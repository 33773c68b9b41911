//! Calls in progress on a connection, so that one without any can be closed after a while.
//!
//! A call begins with its request and ends with the last byte of its answer: an open stream is a call.

use std::{
    pin::Pin,
    task::{Context, Poll},
    time::Duration,
};

use bytes::Bytes;
use hyper::body::{Body as HttpBody, Frame, SizeHint};
use tokio::{sync::watch, time::timeout};
use tonic::{Status, body::Body};

/// Counts the calls of one connection.
#[derive(Clone, Debug)]
pub(super) struct Activity(watch::Sender<usize>);

/// A call in progress, until it is dropped.
#[derive(Debug)]
pub(super) struct Call(watch::Sender<usize>);

/// The body of an answer, whose end is the end of its call.
#[derive(Debug)]
pub(super) struct CallBody {
    inner: Body,
    _call: Call,
}

impl Activity {
    pub(super) fn new() -> Self {
        Self(watch::Sender::new(0))
    }

    /// A call begins.
    pub(super) fn begin(&self) -> Call {
        self.0.send_modify(|calls| *calls += 1);
        Call(self.0.clone())
    }

    /// Waits until there was no call for `time`.
    pub(super) async fn idle(&self, time: Duration) {
        let mut calls = self.0.subscribe();
        loop {
            // The sender lives as long as `self`: waiting cannot fail.
            let _ = calls.wait_for(|calls| *calls == 0).await;
            if timeout(time, calls.changed()).await.is_err() {
                return;
            }
        }
    }
}

impl Call {
    /// The answer to this call.
    pub(super) fn answered(self, inner: Body) -> CallBody {
        CallBody { inner, _call: self }
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        self.0.send_modify(|calls| *calls -= 1);
    }
}

impl HttpBody for CallBody {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        Pin::new(&mut self.inner).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.inner.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.inner.size_hint()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORT: Duration = Duration::from_millis(50);
    /// Whatever takes this long hangs.
    const PATIENCE: Duration = Duration::from_mins(1);

    #[tokio::test]
    async fn a_connection_is_idle_only_after_its_last_call() {
        let activity = Activity::new();
        timeout(PATIENCE, activity.idle(SHORT)).await.expect("nobody ever called");

        let call = activity.begin().answered(Body::empty());
        let other = activity.begin();
        drop(other);
        timeout(SHORT * 4, activity.idle(SHORT)).await.expect_err("a call is in progress");
        drop(call);
        timeout(PATIENCE, activity.idle(SHORT)).await.expect("no call is left");
    }
}

//! Calls in progress on a connection, so that one without any can be closed after a while.
//!
//! A call begins with its request and ends with the last byte of its answer: an open stream is a call.

use std::time::Duration;

use bytes::Bytes;
use http_body_util::BodyExt as _;
use hyper::body::Body as HttpBody;
use tokio::{sync::watch, time::timeout};
use tonic::{Status, body::Body};

/// Counts the calls of one connection.
#[derive(Clone, Debug)]
pub(super) struct Activity(watch::Sender<usize>);

/// A call in progress, until it is dropped.
#[derive(Debug)]
pub(super) struct Call(watch::Sender<usize>);

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
    /// The body of the answer to this call, whose end is the end of the call.
    pub(super) fn answered(self, inner: Body) -> impl HttpBody<Data = Bytes, Error = Status> + Send {
        // What errors go through lives as long as the body, and has the call.
        inner.map_err(move |status| {
            let _ = &self;
            status
        })
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        self.0.send_modify(|calls| *calls -= 1);
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

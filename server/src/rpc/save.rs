//! SaveSession: the file of a session on its way to a client, in pieces.
//!
//! Enters: a file. Leaves: messages of at most 1 MiB of it. Its memory, and its place among the uploads, are free once the last piece is
//! fetched, or the client fetches nothing for too long.

use std::{
    pin::Pin,
    task::{Context, Poll, ready},
    time::Duration,
};

use nappe_proto::v1;
use tokio::{
    sync::{OwnedSemaphorePermit, mpsc},
    time::timeout,
};
use tokio_stream::Stream;
use tokio_util::sync::CancellationToken;
use tonic::Status;

use crate::{
    config::PIECE_BYTES,
    error::{Reason, ServiceError},
    session::SavedFile,
};

/// The pieces of a file, in order.
#[derive(Debug)]
pub(crate) struct Pieces {
    ready: mpsc::Receiver<v1::SaveSessionResponse>,
    /// Bytes that are to come.
    left: u64,
    /// How long a client may fetch nothing.
    patience: Duration,
    draining: CancellationToken,
}

/// The pieces of a file, which holds `place` until they are fetched. They end with an error if a client fetches none for longer than
/// `patience`, or the server drains.
pub(super) fn pieces(
    file: SavedFile,
    place: OwnedSemaphorePermit,
    patience: Duration,
    draining: CancellationToken,
) -> Pieces {
    let (sender, ready) = mpsc::channel(1);
    let byte_count = file.bytes.len() as u64;
    let drained = draining.clone();
    tokio::spawn(async move {
        let SavedFile { mut bytes, memory: _memory } = file;
        let _place = place;
        while !bytes.is_empty() {
            let data = bytes.split_to(bytes.len().min(PIECE_BYTES));
            let piece = v1::SaveSessionResponse { byte_count, data };
            let is_sent = tokio::select! {
                sent = timeout(patience, sender.send(piece)) => matches!(sent, Ok(Ok(()))),
                () = drained.cancelled() => false,
            };
            if !is_sent {
                return;
            }
        }
    });
    Pieces { ready, left: byte_count, patience, draining }
}

impl Pieces {
    /// Why the rest does not come.
    fn cut(&self) -> ServiceError {
        if self.draining.is_cancelled() {
            return ServiceError::draining();
        }
        let seconds = self.patience.as_secs_f64();
        let message = format!("no piece of the file was fetched for {seconds} s: the rest is dropped");
        ServiceError::new(Reason::WatcherStalled, message).with("seconds", seconds)
    }
}

impl Stream for Pieces {
    type Item = Result<v1::SaveSessionResponse, Status>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        Poll::Ready(match ready!(self.ready.poll_recv(context)) {
            Some(piece) => {
                self.left = self.left.saturating_sub(piece.data.len() as u64);
                Some(Ok(piece))
            }
            None if self.left == 0 => None,
            None => {
                self.left = 0;
                Some(Err(self.cut().into()))
            }
        })
    }
}

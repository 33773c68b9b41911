//! The reader's end of a watcher, which the body of its answer polls: messages, then why the stream broke, if it did.
//!
//! Enters: what a watcher's task sends. Leaves: the items of the stream, the status last.

use std::{
    pin::Pin,
    sync::{Arc, OnceLock},
    task::{Context, Poll},
};

use tokio::sync::OwnedSemaphorePermit;
use tokio_stream::Stream;
use tonic::Status;

use super::{demand::Wish, slot::Receiver, transit::Transit};
use crate::refusals::Call;

/// The reader's end of a watcher; the last item is the status that broke the stream, if one did.
#[derive(Debug)]
pub(crate) struct WatchStream<M> {
    messages: Receiver<M>,
    broken: Arc<OnceLock<Broken<M>>>,
    /// How much of `broken` was handed out.
    told: Told,
    transit: Arc<Transit>,
}

/// Why a stream broke.
#[derive(Debug)]
pub(super) struct Broken<M> {
    /// A last message before the status.
    pub farewell: Option<M>,
    pub status: Status,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Told {
    Nothing,
    Farewell,
    Status,
}

/// A place among a session's watchers, the call that has it, and what the watcher wants of frames: none for one that wants no
/// fields.
#[derive(Debug)]
pub(crate) struct Seat {
    // Dropped in this order: who is no longer counted wants nothing any more.
    _wish: Option<Wish>,
    _slot: OwnedSemaphorePermit,
    pub(super) call: Call,
}

impl Seat {
    pub(crate) fn new(slot: OwnedSemaphorePermit, wish: Option<Wish>, call: Call) -> Self {
        Self { _wish: wish, _slot: slot, call }
    }
}

impl<M: Clone> WatchStream<M> {
    /// A stream of messages; the second value is where to write, once, why it breaks.
    pub(super) fn new(messages: Receiver<M>, transit: Arc<Transit>) -> (Self, Arc<OnceLock<Broken<M>>>) {
        let broken = Arc::new(OnceLock::new());
        let stream = Self { messages, broken: Arc::clone(&broken), told: Told::Nothing, transit };
        (stream, broken)
    }

    /// Where the bytes of its messages are counted while they are on their way.
    pub(super) fn transit(&self) -> &Arc<Transit> {
        &self.transit
    }

    /// What is left to say once the messages have run dry.
    fn tell_why_broken(&mut self) -> Option<Result<M, Status>> {
        let broken = self.broken.get()?;
        if self.told == Told::Nothing {
            self.told = Told::Farewell;
            if let Some(farewell) = &broken.farewell {
                return Some(Ok(farewell.clone()));
            }
        }
        if self.told == Told::Farewell {
            self.told = Told::Status;
            return Some(Err(broken.status.clone()));
        }
        None
    }
}

impl<M: Clone> Stream for WatchStream<M> {
    type Item = Result<M, Status>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        self.messages.poll_fetch(context).map(|message| match message {
            Some(message) => Some(Ok(message)),
            None => self.tell_why_broken(),
        })
    }
}

//! A place for one message between a watcher's task and the stream that carries it. Unlike a channel, it lets the
//! sender take a message back that nobody fetched.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    task::{Context, Poll, Waker},
};

use tokio::sync::Notify;

/// The receiver is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Closed;

#[derive(Debug)]
struct Slot<M> {
    content: Mutex<Content<M>>,
    /// Told when the message was fetched or the receiver is gone.
    fetched: Notify,
}

#[derive(Debug)]
struct Content<M> {
    message: Option<M>,
    receiver: Option<Waker>,
    has_sender: bool,
    has_receiver: bool,
}

/// The task's end.
#[derive(Debug)]
pub(super) struct Sender<M>(Arc<Slot<M>>);

/// The stream's end.
#[derive(Debug)]
pub(super) struct Receiver<M>(Arc<Slot<M>>);

/// An empty slot.
pub(super) fn slot<M>() -> (Sender<M>, Receiver<M>) {
    let content = Content { message: None, receiver: None, has_sender: true, has_receiver: true };
    let slot = Arc::new(Slot { content: Mutex::new(content), fetched: Notify::new() });
    (Sender(Arc::clone(&slot)), Receiver(slot))
}

impl<M> Slot<M> {
    fn lock(&self) -> MutexGuard<'_, Content<M>> {
        // No code that holds the lock can leave it half changed.
        self.content.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<M> Sender<M> {
    /// Whether the slot is empty.
    pub(super) fn has_room(&self) -> Result<bool, Closed> {
        let content = self.0.lock();
        if content.has_receiver { Ok(content.message.is_none()) } else { Err(Closed) }
    }

    /// Waits until the slot is empty.
    pub(super) async fn room(&self) -> Result<(), Closed> {
        // The only task that waits: a notification that comes first is kept for it.
        while !self.has_room()? {
            self.0.fetched.notified().await;
        }
        Ok(())
    }

    /// Waits until the receiver is gone.
    pub(super) async fn closed(&self) {
        while self.has_room().is_ok() {
            self.0.fetched.notified().await;
        }
    }

    /// Puts a message into the empty slot.
    pub(super) fn put(&self, message: M) {
        let receiver = {
            let mut content = self.0.lock();
            content.message = Some(message);
            content.receiver.take()
        };
        if let Some(receiver) = receiver {
            receiver.wake();
        }
    }

    /// Drops a message that was not fetched.
    pub(super) fn take_back(&self) {
        let message = self.0.lock().message.take();
        drop(message);
    }
}

impl<M> Receiver<M> {
    /// The next message; `None` once the sender is gone.
    pub(super) fn poll_fetch(&self, context: &Context<'_>) -> Poll<Option<M>> {
        let mut content = self.0.lock();
        if let Some(message) = content.message.take() {
            drop(content);
            self.0.fetched.notify_waiters();
            self.0.fetched.notify_one();
            return Poll::Ready(Some(message));
        }
        if !content.has_sender {
            return Poll::Ready(None);
        }
        content.receiver = Some(context.waker().clone());
        Poll::Pending
    }
}

impl<M> Drop for Sender<M> {
    fn drop(&mut self) {
        let receiver = {
            let mut content = self.0.lock();
            content.has_sender = false;
            content.receiver.take()
        };
        if let Some(receiver) = receiver {
            receiver.wake();
        }
    }
}

impl<M> Drop for Receiver<M> {
    fn drop(&mut self) {
        let message = {
            let mut content = self.0.lock();
            content.has_receiver = false;
            content.message.take()
        };
        drop(message);
        self.0.fetched.notify_waiters();
        self.0.fetched.notify_one();
    }
}

//! What rank 0 says: answers, and signs of life while it works, given in a thread of their own.

use std::{
    net::TcpStream,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
    time::Duration,
};

use serde::Serialize;

use crate::{
    counted::Counted,
    link::{LinkError, Sender},
    message::Answer,
};

/// Time between two signs of life.
pub(crate) const INTERVAL: Duration = Duration::from_secs(2);

/// The way from rank 0 to the server, which answers and signs of life share.
#[derive(Debug)]
pub(crate) struct Voice(Mutex<Way>);

#[derive(Debug)]
struct Way {
    stream: TcpStream,
    sender: Sender,
    /// Whether an order is being carried out: only then somebody listens.
    is_busy: bool,
}

impl Way {
    fn send(&mut self, message: &impl Serialize) -> Result<(), LinkError> {
        self.sender.send(&mut self.stream, message)
    }
}

impl Voice {
    /// Of a connection over which nothing was said but the token.
    pub(crate) fn new(stream: TcpStream) -> Self {
        Self(Mutex::new(Way { stream, sender: Sender::default(), is_busy: false }))
    }

    /// Says what no order asked for.
    ///
    /// # Errors
    /// When the link fails.
    pub(crate) fn say(&self, message: &impl Serialize) -> Result<(), LinkError> {
        self.way().send(message)
    }

    /// An order has come: signs of life are given until it is answered.
    pub(crate) fn begin(&self) {
        self.way().is_busy = true;
    }

    /// Answers the order.
    ///
    /// # Errors
    /// When the link fails.
    pub(crate) fn answer(&self, answer: &Answer) -> Result<(), LinkError> {
        let mut way = self.way();
        way.is_busy = false;
        way.send(answer)
    }

    /// Gives a sign of life while an answer is being made.
    fn sign(&self, alive: &Answer) -> Result<(), LinkError> {
        let mut way = self.way();
        if way.is_busy { way.send(alive) } else { Ok(()) }
    }

    fn way(&self) -> MutexGuard<'_, Way> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Gives signs of life until rank 0 is done, or its link has ended.
pub(crate) fn give_signs(voice: &Arc<Voice>, counted: &Arc<Counted>) {
    let (voice, counted) = (Arc::downgrade(voice), Arc::downgrade(counted));
    thread::spawn(move || {
        let mut before = 0;
        loop {
            thread::sleep(INTERVAL);
            let (Some(voice), Some(counted)) = (voice.upgrade(), counted.upgrade()) else { return };
            let bounds = counted.bounds();
            let waits = bounds % 2 == 1 && bounds == before;
            before = bounds;
            if voice.sign(&Answer::Alive { waits }).is_err() {
                return;
            }
        }
    });
}

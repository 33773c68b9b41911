//! One watcher of a session: a task that carries frames to a stream at the reader's own pace.
//!
//! Enters: the session's feed. Leaves: messages, then the end or the reason why the stream broke.
//! The task waits for the reader; the stepper never waits for the task.

use std::{
    pin::Pin,
    sync::{Arc, OnceLock},
    task::{Context, Poll},
    time::Duration,
};

use tokio::{
    sync::{OwnedSemaphorePermit, mpsc, watch},
    time::{Interval, MissedTickBehavior},
};
use tokio_stream::Stream;
use tokio_util::sync::CancellationToken;
use tonic::Status;

use super::{
    demand::Wish,
    feed::{Ending, Feed, Newest},
    fields::FieldSet,
    frame::EncodedFrame,
    history::Lookup,
    stream_kind::StreamKind,
};
use crate::error::{Reason, ServiceError};

/// Messages that wait for the reader, besides those in HTTP/2's buffers. More would only be older.
const WAITING_MESSAGES: usize = 1;

/// Which frames a watcher gets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Delivery {
    /// The newest frame whenever the reader is ready.
    Latest {
        /// Least time between two frames; `None`: no limit.
        period: Option<Duration>,
    },
    /// Every frame from a number on.
    Every {
        /// The first frame; `None`: the newest.
        from_frame: Option<u64>,
    },
}

/// The reader's end of a watcher; the last item is the status that broke the stream, if one did.
#[derive(Debug)]
pub(crate) struct WatchStream<M> {
    messages: mpsc::Receiver<M>,
    broken: Arc<OnceLock<Status>>,
    /// Whether `broken` was handed out.
    ended: bool,
    /// What the watcher holds of the session until the stream is dropped.
    _seat: Seat,
}

/// A place among a session's watchers, and what the watcher wants of frames: none for one that wants no fields.
#[derive(Debug)]
pub(crate) struct Seat {
    _slot: OwnedSemaphorePermit,
    _wish: Option<Wish>,
}

impl Seat {
    pub(crate) fn new(slot: OwnedSemaphorePermit, wish: Option<Wish>) -> Self {
        Self { _slot: slot, _wish: wish }
    }
}

impl<M> Stream for WatchStream<M> {
    type Item = Result<M, Status>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        self.messages.poll_recv(context).map(|message| match message {
            Some(message) => Some(Ok(message)),
            None if self.ended => None,
            None => {
                self.ended = true;
                self.broken.get().cloned().map(Err)
            }
        })
    }
}

/// Why a watcher's task ends.
enum Leave {
    /// The reader is gone, or the session finished.
    Quietly,
    /// The stream breaks.
    With(ServiceError),
}

/// Starts a watcher: first the messages of `opening`, then frames as `delivery` says.
pub(crate) fn watch<S: StreamKind>(
    feed: Arc<Feed>,
    kind: S,
    delivery: Delivery,
    opening: Vec<S::Message>,
    seat: Seat,
    draining: CancellationToken,
) -> WatchStream<S::Message> {
    let (sender, messages) = mpsc::channel(WAITING_MESSAGES);
    let broken = Arc::new(OnceLock::new());
    let stream = WatchStream { messages, broken: Arc::clone(&broken), ended: false, _seat: seat };
    let newest = feed.subscribe();

    let mut watcher = Watcher { feed, newest, kind, sender: sender.clone() };
    tokio::spawn(async move {
        let leave = tokio::select! {
            biased;
            () = draining.cancelled() => Leave::With(ServiceError::draining()),
            () = sender.closed() => Leave::Quietly,
            Err(leave) = watcher.run(opening, delivery) => leave,
        };
        if let Leave::With(error) = leave {
            // Before the sender is dropped, so that the stream finds it when it runs dry.
            broken.set(error.into()).expect("one task sets it once");
        }
        drop(watcher);
    });
    stream
}

struct Watcher<S: StreamKind> {
    feed: Arc<Feed>,
    newest: watch::Receiver<Newest>,
    kind: S,
    sender: mpsc::Sender<S::Message>,
}

impl<S: StreamKind> Watcher<S> {
    /// Carries frames until there is a reason to leave, which is the error.
    async fn run(&mut self, opening: Vec<S::Message>, delivery: Delivery) -> Result<(), Leave> {
        for message in opening {
            self.send(message).await?;
        }
        match delivery {
            Delivery::Latest { period } => self.latest(period.map(ticker)).await,
            Delivery::Every { from_frame } => self.every(from_frame).await,
        }
    }

    async fn latest(&mut self, mut ticker: Option<Interval>) -> Result<(), Leave> {
        let mut sent = None;
        loop {
            let wanted = self.kind.needed();
            let news = |newest: &Newest| is_news(newest, sent, wanted);
            gone(self.newest.wait_for(|newest| newest.ending.is_some() || news(newest)).await)?;

            tokio::select! {
                () = next_tick(&mut ticker) => {}
                ended = self.newest.wait_for(|newest| newest.ending.is_some()) => { gone(ended)?; }
            }

            // The newest is taken only when the reader has room, so that it is fresh.
            let room = self.sender.reserve().await.map_err(|_closed| Leave::Quietly)?;
            let newest = self.newest.borrow_and_update().clone();

            if is_news(&newest, sent, wanted) {
                let number = newest.frame.head.frame;
                let dropped = sent.map_or(0, |sent: u64| number.saturating_sub(sent + 1));
                let mut messages = messages(self.kind, &newest.frame, dropped).await?.into_iter();
                if let Some(first) = messages.next() {
                    room.send(first);
                }
                for message in messages {
                    self.send(message).await?;
                }
                sent = Some(number);
            } else if let Some(ending) = newest.ending {
                drop(room);
                return self.finish(&ending).await;
            }
        }
    }

    async fn every(&mut self, from_frame: Option<u64>) -> Result<(), Leave> {
        let mut next = match from_frame {
            Some(number) => number,
            None => self.newest_complete(),
        };

        loop {
            // Read before the history, so that an end seen here comes after all frames there.
            let ending = self.newest.borrow_and_update().ending.clone();
            match self.feed.lookup(next, self.kind.needed()) {
                Lookup::Found(frame) => {
                    for message in messages(self.kind, &frame, 0).await? {
                        self.send_or_fall_behind(message, next).await?;
                    }
                    next += 1;
                }
                Lookup::Expired { oldest } => return Err(Leave::With(too_slow(next, oldest))),
                Lookup::NotYet => match ending {
                    Some(ending) => return self.finish(&ending).await,
                    None => gone(self.newest.changed().await)?,
                },
            }
        }
    }

    /// Number of the newest frame if it holds what is needed, else of the frame after it.
    fn newest_complete(&self) -> u64 {
        let frame = &self.newest.borrow().frame;
        frame.head.frame + u64::from(!frame.fields().covers(self.kind.needed()))
    }

    async fn finish(&mut self, ending: &Ending) -> Result<(), Leave> {
        match ending {
            Ending::Broken(error) => Err(Leave::With(error.clone())),
            Ending::Finished(end) => {
                if let Some(message) = self.kind.end(*end) {
                    self.send(message).await?;
                }
                Err(Leave::Quietly)
            }
        }
    }

    async fn send(&self, message: S::Message) -> Result<(), Leave> {
        self.sender.send(message).await.map_err(|_closed| Leave::Quietly)
    }

    /// Sends a message of frame `current`. Gives up when the frame after it is dropped from the
    /// history: a reader that stalls for ever must not hold memory.
    async fn send_or_fall_behind(&mut self, message: S::Message, current: u64) -> Result<(), Leave> {
        tokio::select! {
            biased;
            sent = self.sender.send(message) => sent.map_err(|_closed| Leave::Quietly),
            newest = self.newest.wait_for(|newest| newest.oldest > current + 1) => {
                let oldest = newest.map_or(current, |newest| newest.oldest);
                Err(Leave::With(too_slow(current, oldest)))
            }
        }
    }
}

/// The messages of a frame. Nodes of a grid are chosen and packed on other threads than those that
/// carry the streams, because there may be millions.
async fn messages<S: StreamKind>(
    kind: S,
    frame: &Arc<EncodedFrame>,
    dropped_count: u64,
) -> Result<Vec<S::Message>, Leave> {
    if !kind.needed().covers(FieldSet::GRID) {
        return Ok(kind.messages(frame, dropped_count));
    }

    let frame = Arc::clone(frame);
    let packed = tokio::task::spawn_blocking(move || kind.messages(&frame, dropped_count)).await;
    packed.map_err(|_panic| {
        Leave::With(ServiceError::internal("packing the grid's nodes panicked: this is a bug in the server"))
    })
}

fn is_news(newest: &Newest, sent: Option<u64>, wanted: FieldSet) -> bool {
    sent != Some(newest.frame.head.frame) && newest.frame.fields().covers(wanted)
}

/// A feed lives as long as its watchers: its end would only mean that nothing more comes.
fn gone<T, E>(outcome: Result<T, E>) -> Result<(), Leave> {
    outcome.map(|_| ()).map_err(|_closed| Leave::Quietly)
}

fn ticker(period: Duration) -> Interval {
    let mut ticker = tokio::time::interval(period.max(Duration::from_micros(1)));
    ticker.set_missed_tick_behavior(MissedTickBehavior::Delay);
    ticker
}

async fn next_tick(ticker: &mut Option<Interval>) {
    if let Some(ticker) = ticker {
        ticker.tick().await;
    }
}

fn too_slow(next: u64, oldest: u64) -> ServiceError {
    let message = format!("frame {next} was due, but the oldest that the session keeps is {oldest}");
    ServiceError::new(Reason::WatcherTooSlow, message).with("next_frame", next).with("oldest_frame", oldest)
}

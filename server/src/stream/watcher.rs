//! One watcher of a session: a task that carries frames and changes of state to a stream at the reader's own pace.
//!
//! Enters: the session's feed. Leaves: messages, then the end or the reason why the stream broke.
//! The task waits for the reader; the stepper never waits for the task. What a stream promises stands in
//! docs/service.md: it is ordered, unique, reliable, resumable, bookmarkable and atomic.

use std::{sync::Arc, time::Duration};

use nappe_proto::v1;
use tokio::{
    sync::{mpsc, watch},
    time::{Instant, Interval, MissedTickBehavior, sleep_until},
};
use tokio_util::sync::CancellationToken;

use super::{
    feed::{Ending, Feed, Newest, not_made},
    fields::FieldSet,
    frame::EncodedFrame,
    history::Lookup,
    stream_kind::StreamKind,
    watch_stream::{Broken, Seat, WatchStream},
};
use crate::error::{Reason, ServiceError};

/// Messages that wait for the reader, besides those in HTTP/2's buffers. More would only be older.
const WAITING_MESSAGES: usize = 1;

/// A watcher without frames for this long is told how far the session is.
const QUIET: Duration = Duration::from_secs(5);

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

/// Why a watcher's task ends.
enum Leave {
    /// The reader is gone, or the session finished.
    Quietly,
    /// The stream breaks.
    With(ServiceError),
}

/// Starts a watcher: first the messages of `opening`, then how the session stands, then frames as `delivery` says.
pub(crate) fn watch<S: StreamKind>(
    feed: Arc<Feed>,
    kind: S,
    delivery: Delivery,
    mut opening: Vec<S::Message>,
    seat: Seat,
    draining: CancellationToken,
) -> WatchStream<S::Message> {
    let (sender, messages) = mpsc::channel(WAITING_MESSAGES);
    let (stream, broken) = WatchStream::new(messages, seat);
    let newest = feed.subscribe();

    let present = feed.present();
    let (change, quiet_since, within_frame) = (present.number, Instant::now(), false);
    opening.push(kind.change(present));

    let mut watcher =
        Watcher { feed, newest, kind, sender: sender.clone(), change, quiet_since, within_frame };
    tokio::spawn(async move {
        let leave = tokio::select! {
            biased;
            () = draining.cancelled() => Leave::With(ServiceError::draining()),
            () = sender.closed() => Leave::Quietly,
            Err(leave) = watcher.run(opening, delivery) => leave,
        };
        if let Leave::With(error) = leave {
            // Before the sender is dropped, so that the stream finds it when it runs dry.
            let told = broken.set(Broken { farewell: watcher.farewell(&error), status: error.into() });
            assert!(told.is_ok(), "one task sets it once");
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
    /// Number of the last change of state that was sent.
    change: u64,
    /// When a frame, or word that there is none, was sent last.
    quiet_since: Instant,
    /// Whether some pieces of a frame are sent and others not.
    within_frame: bool,
}

impl<S: StreamKind> Watcher<S> {
    /// Carries frames until there is a reason to leave, which is the error.
    async fn run(&mut self, opening: Vec<S::Message>, delivery: Delivery) -> Result<(), Leave> {
        for message in opening {
            self.send(message).await?;
        }

        match delivery {
            Delivery::Latest { period } => self.latest(Rate::new(period)).await,
            Delivery::Every { from_frame } => self.every(from_frame).await,
        }
    }

    async fn latest(&mut self, mut rate: Rate) -> Result<(), Leave> {
        let (mut sent, wanted) = (None, self.kind.needed());
        loop {
            if !self.wait_for_latest(sent, &mut rate).await? {
                self.send_progress(sent).await?;
                continue;
            }

            // The newest is taken only when the reader has room, so that it is fresh.
            let room = self.sender.reserve().await.map_err(|_closed| Leave::Quietly)?;
            let newest = self.newest.borrow_and_update().clone();
            let (number, has_news) = (newest.frame.head.frame, is_news(&newest, sent, wanted));

            // What happened before the frame comes before it; all else once no frame is left.
            let before = if has_news { number } else { u64::MAX };
            let change = self.feed.changes(self.change, newest.change).into_iter().next();
            if let Some(change) = change.filter(|change| change.frame < before) {
                self.change = change.number;
                room.send(self.kind.change(change));
            } else if has_news {
                let dropped = sent.map_or(0, |sent: u64| number.saturating_sub(sent + 1));
                let mut messages = messages(self.kind, &newest.frame, dropped).await?.into_iter();
                self.within_frame = messages.len() > 1;
                match messages.next() {
                    Some(first) => room.send(first),
                    None => drop(room),
                }
                for message in messages {
                    self.send(message).await?;
                }
                self.frame_is_sent();
                rate.spend();
                sent = Some(number);
            } else if let Some(ending) = newest.ending {
                drop(room);
                return self.finish(&ending).await;
            }
        }
    }

    /// Waits until the frame after frame `sent`, a change of state or the end can be sent; false if nothing came for
    /// so long that the reader should be told.
    async fn wait_for_latest(&mut self, sent: Option<u64>, rate: &mut Rate) -> Result<bool, Leave> {
        let (told, wanted, quiet_until) = (self.change, self.kind.needed(), self.quiet_since + QUIET);
        let has_ended = |newest: &Newest| newest.ending.is_some();
        let has_news = |newest: &Newest| is_news(newest, sent, wanted);
        let is_awaited = |newest: &Newest| has_ended(newest) || newest.change > told || has_news(newest);
        tokio::select! {
            awaited = self.newest.wait_for(is_awaited) => gone(awaited)?,
            () = sleep_until(quiet_until) => return Ok(false),
        }
        if !has_news(&self.newest.borrow()) {
            return Ok(true);
        }

        tokio::select! {
            () = rate.ready() => {}
            ended = self.newest.wait_for(has_ended) => gone(ended)?,
            () = sleep_until(quiet_until) => return Ok(false),
        }
        Ok(true)
    }

    async fn every(&mut self, from_frame: Option<u64>) -> Result<(), Leave> {
        let mut next = match from_frame {
            Some(number) => number,
            None => self.newest_complete(),
        };

        loop {
            // Read before the history, so that an end seen here comes after all frames there.
            let ending = self.newest.borrow_and_update().ending.clone();
            let found = self.feed.lookup(next, self.kind.needed());
            // Read after it: what happened before a frame that was found is seen here.
            let newest_change = self.newest.borrow().change;
            self.send_changes(newest_change, next).await?;

            match found {
                Lookup::Found(frame) => {
                    let messages = messages(self.kind, &frame, 0).await?;
                    self.within_frame = messages.len() > 1;
                    for message in messages {
                        self.send_or_fall_behind(message, next).await?;
                    }
                    self.frame_is_sent();
                    next += 1;
                }
                Lookup::Expired { oldest } => return Err(Leave::With(too_slow(next, oldest))),
                Lookup::NotYet => match ending {
                    Some(ending) => return self.finish_every(&ending, next).await,
                    None => self.wait_for_news(next).await?,
                },
            }
        }
    }

    /// Waits until something happens, and says meanwhile how far the session is; `next` is the next frame.
    async fn wait_for_news(&mut self, next: u64) -> Result<(), Leave> {
        let quiet_until = self.quiet_since + QUIET;
        tokio::select! {
            changed = self.newest.changed() => gone(changed),
            () = sleep_until(quiet_until) => self.send_progress(next.checked_sub(1)).await,
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
                self.send(self.kind.end(*end)).await?;
                Err(Leave::Quietly)
            }
        }
    }

    /// Ends a stream of every frame, whose next frame, `next`, is not there.
    async fn finish_every(&mut self, ending: &Ending, next: u64) -> Result<(), Leave> {
        match ending {
            Ending::Finished(end) if next > end.frame + 1 => Err(Leave::With(not_made(next, end.frame))),
            ending => self.finish(ending).await,
        }
    }

    /// Sends the changes up to number `newest` that happened before frame `before` was made.
    async fn send_changes(&mut self, newest: u64, before: u64) -> Result<(), Leave> {
        for change in self.feed.changes(self.change, newest) {
            if change.frame >= before {
                break;
            }
            self.change = change.number;
            self.send(self.kind.change(change)).await?;
        }
        Ok(())
    }

    /// Says that all up to frame `sent` was sent, or, if nothing was yet, how far the session is.
    async fn send_progress(&mut self, sent: Option<u64>) -> Result<(), Leave> {
        let (newest, step, time_seconds) = {
            let head = &self.newest.borrow().frame.head;
            (head.frame, head.step, head.time_seconds)
        };
        let frame = sent.map_or(newest, |sent| sent.min(newest));
        self.send(self.kind.progress(v1::Progress { frame, step, time_seconds })).await?;
        self.quiet_since = Instant::now();
        Ok(())
    }

    fn frame_is_sent(&mut self) {
        (self.within_frame, self.quiet_since) = (false, Instant::now());
    }

    /// The last message before the status of a stream that a shutdown breaks, unless it breaks a frame.
    fn farewell(&self, error: &ServiceError) -> Option<S::Message> {
        if error.reason != Reason::ServerDraining || self.within_frame {
            return None;
        }
        let mut change = self.feed.present();
        change.set_kind(v1::ChangeKind::Draining);
        Some(self.kind.change(change))
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

/// How often a watcher of the newest gets a frame.
struct Rate {
    /// None: as often as there is one.
    ticker: Option<Interval>,
    /// Whether the time of the next frame has come.
    is_time: bool,
}

impl Rate {
    /// At most one frame in each `period`.
    fn new(period: Option<Duration>) -> Self {
        let ticker = period.map(|period| {
            let mut ticker = tokio::time::interval(period.max(Duration::from_micros(1)));
            ticker.set_missed_tick_behavior(MissedTickBehavior::Delay);
            ticker
        });
        Self { ticker, is_time: false }
    }

    /// Waits until the time of the next frame. Dropping the future loses nothing.
    async fn ready(&mut self) {
        if let Some(ticker) = self.ticker.as_mut().filter(|_| !self.is_time) {
            ticker.tick().await;
        }
        self.is_time = true;
    }

    /// A frame was sent.
    fn spend(&mut self) {
        self.is_time = false;
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

fn too_slow(next: u64, oldest: u64) -> ServiceError {
    let message = format!("frame {next} was due, but the oldest that the session keeps is {oldest}");
    ServiceError::new(Reason::WatcherTooSlow, message).with("next_frame", next).with("oldest_frame", oldest)
}

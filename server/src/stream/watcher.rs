//! One watcher of a session: a task that carries frames and changes to a stream at its reader's pace.
//!
//! Enters: the session's feed. Leaves: messages, then the end or the reason why the stream broke.
//! The task waits for the reader; the stepper never waits for the task. What a stream promises stands in
//! docs/service.md: it is ordered, unique, reliable, resumable, bookmarkable and atomic.

use std::{sync::Arc, time::Duration};

use nappe_proto::v1;
use tokio::{
    sync::watch,
    time::{Instant, sleep, sleep_until},
};
use tokio_util::sync::CancellationToken;

use super::{
    delivery::{Delivery, Pace, Rate},
    feed::{Ending, Feed, Kept, Need, Newest, not_made},
    fields::FieldSet,
    frame::EncodedFrame,
    history::Lookup,
    leave::Leave,
    slot::{Closed, Sender, slot},
    stream_kind::StreamKind,
    transit::{Cut, Transit},
    watch_stream::{Broken, Seat, WatchStream},
};
use crate::error::{Reason, ServiceError};

/// A watcher without frames for this long is told how far the session is.
const QUIET: Duration = Duration::from_secs(5);

/// Starts a watcher on a connection that may be `cut`: first the messages of `opening`, then how the session stands,
/// then frames as `delivery` says.
pub(crate) fn watch<S: StreamKind>(
    feed: Arc<Feed>,
    kind: S,
    delivery: Delivery,
    mut opening: Vec<S::Message>,
    seat: Seat,
    cut: Cut,
    draining: CancellationToken,
) -> WatchStream<S::Message> {
    let (sender, messages) = slot();
    let streams = Arc::clone(feed.streams());
    let transit = Transit::new(streams.memory());
    let (stream, broken) = WatchStream::new(messages, Arc::clone(&transit));
    let (sender, newest) = (Arc::new(sender), feed.subscribe());

    let present = feed.present();
    let change = present.number;
    opening.push(kind.change(present));

    let mut watcher = Watcher {
        feed,
        newest,
        kind,
        sender: Arc::clone(&sender),
        give_way: CancellationToken::new(),
        change,
        quiet_since: Instant::now(),
        within_frame: false,
    };
    // Before the call is answered: from then on frames are kept, whenever the task comes to run.
    let need = watcher.need(delivery);
    let call = seat.call.clone();
    tokio::spawn(async move {
        let leave = tokio::select! {
            biased;
            () = draining.cancelled() => Leave::WithOthers(ServiceError::draining()),
            () = sender.closed() => Leave::Quietly,
            Err(leave) = watcher.run(opening, delivery, need) => leave,
        };
        if let Some(error) = leave.error(&call) {
            if error.reason == Reason::WatcherStalled {
                // Nobody fetches it, and it holds a frame.
                sender.take_back();
            }
            // Before the sender is dropped, so that the stream finds it when it runs dry.
            let told = broken.set(Broken { farewell: watcher.farewell(&error), status: error.into() });
            assert!(told.is_ok(), "one task sets it once");
        }
        drop((watcher, sender, seat));
        transit.end(&call, &cut, streams.max_held_bytes, streams.stall).await;
    });
    stream
}

struct Watcher<S: StreamKind> {
    feed: Arc<Feed>,
    newest: watch::Receiver<Newest>,
    kind: S,
    sender: Arc<Sender<S::Message>>,
    /// Cancelled when watchers hold too much, and this one has waited longest.
    give_way: CancellationToken,
    /// Number of the last change of state that was sent.
    change: u64,
    /// When a frame, or word that there is none, was sent last.
    quiet_since: Instant,
    /// Whether some pieces of a frame are sent and others not.
    within_frame: bool,
}

impl<S: StreamKind> Watcher<S> {
    /// The frames that are kept for it.
    fn need(&self, delivery: Delivery) -> Option<Need> {
        match delivery {
            Delivery::Every { from_frame, pace: Pace::Watcher } => {
                let first = from_frame.unwrap_or_else(|| self.newest_complete());
                Some(self.feed.keep(Kept::Paced, first))
            }
            Delivery::Every { from_frame: Some(first), pace: Pace::Session } => {
                Some(self.feed.keep(Kept::Opening, first))
            }
            _ => None,
        }
    }

    /// Carries frames until there is a reason to leave, which is the error.
    async fn run(
        &mut self,
        opening: Vec<S::Message>,
        delivery: Delivery,
        need: Option<Need>,
    ) -> Result<(), Leave> {
        for message in opening {
            self.send(message).await?;
        }

        match delivery {
            Delivery::Latest { period } => self.latest(Rate::new(period)).await,
            Delivery::Every { from_frame, pace } => {
                self.every(from_frame, need.filter(|_| pace == Pace::Watcher)).await
            }
        }
    }

    async fn latest(&mut self, mut rate: Rate) -> Result<(), Leave> {
        let (mut sent, wanted) = (None, self.kind.needed());
        loop {
            // The newest is taken only when the reader has room, so that it is fresh.
            self.room().await?;
            if !self.wait_for_latest(sent, &mut rate).await? {
                self.send_progress(sent).await?;
                continue;
            }

            let newest = self.newest.borrow_and_update().clone();
            let number = newest.frame.head.frame;
            let has_news = is_news(&newest, sent, wanted) && number >= self.feed.first_shown();

            // What happened before the frame comes before it; all else once no frame is left.
            let before = if has_news { number } else { u64::MAX };
            let change = self.feed.changes(self.change, newest.change).into_iter().next();
            if let Some(change) = change.filter(|change| change.frame < before) {
                self.change = change.number;
                self.sender.put(self.kind.change(change));
            } else if has_news {
                let dropped = sent.map_or(0, |sent: u64| number.saturating_sub(sent + 1));
                let messages = self.messages(&newest.frame, dropped).await?;
                drop(newest);
                self.within_frame = messages.len() > 1;
                for message in messages {
                    self.send(message).await?;
                }
                self.frame_is_sent();
                rate.spend();
                sent = Some(number);
            } else if let Some(ending) = newest.ending {
                return self.finish(&ending).await;
            }
        }
    }

    /// Waits until the frame after frame `sent`, a change of state or the end can be sent; false if nothing came for
    /// so long that the reader should be told.
    async fn wait_for_latest(&mut self, sent: Option<u64>, rate: &mut Rate) -> Result<bool, Leave> {
        let (told, wanted, quiet_until) = (self.change, self.kind.needed(), self.quiet_since + QUIET);
        let has_ended = |newest: &Newest| newest.ending.is_some();
        let first = self.feed.first_shown();
        let has_news = |newest: &Newest| is_news(newest, sent, wanted) && newest.frame.head.frame >= first;
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

    async fn every(&mut self, from_frame: Option<u64>, need: Option<Need>) -> Result<(), Leave> {
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
                    let messages = self.messages(&frame, 0).await?;
                    drop(frame);
                    self.within_frame = messages.len() > 1;
                    for message in messages {
                        self.send_or_fall_behind(message, next).await?;
                    }
                    self.frame_is_sent();
                    next += 1;
                    if let Some(need) = &need {
                        need.advance(next);
                    }
                }
                Lookup::Expired { oldest } => return Err(Leave::too_slow(next, oldest)),
                Lookup::NotYet => {
                    if let Some(ending) = ending {
                        return self.finish_every(&ending, next).await;
                    }
                    self.room().await?;
                    self.wait_for_news(next).await?;
                }
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
        let complete = frame.head.frame + u64::from(!frame.fields().covers(self.kind.needed()));
        complete.max(self.feed.first_shown())
    }

    async fn finish(&mut self, ending: &Ending) -> Result<(), Leave> {
        match ending {
            Ending::Broken(error) => Err(Leave::WithOthers(error.clone())),
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
        self.room().await?;
        self.sender.put(message);
        Ok(())
    }

    /// Waits until the reader has fetched what was sent, but not for ever.
    async fn room(&self) -> Result<(), Leave> {
        if self.sender.has_room().map_err(|Closed| Leave::Quietly)? {
            return Ok(());
        }

        let streams = self.feed.streams();
        let _waits = streams.wait(&self.give_way);
        tokio::select! {
            // Who has fetched has not stalled, however late we look.
            biased;
            room = self.sender.room() => room.map_err(|Closed| Leave::Quietly),
            () = sleep(streams.stall) => Err(Leave::stalled(streams.stall)),
            () = self.give_way.cancelled() => Err(Leave::gave_way(streams.max_held_bytes)),
        }
    }

    /// Sends a message of frame `current`. Gives up when the frame after it is dropped from the
    /// history: a reader that stalls for ever must not hold memory.
    async fn send_or_fall_behind(&mut self, message: S::Message, current: u64) -> Result<(), Leave> {
        let mut newest = self.newest.clone();
        tokio::select! {
            biased;
            sent = self.send(message) => sent,
            newest = newest.wait_for(|newest| newest.oldest > current + 1) => {
                let oldest = newest.map_or(current, |newest| newest.oldest);
                Err(Leave::too_slow(current, oldest))
            }
        }
    }

    /// The messages of a frame. Nodes of a grid are chosen and packed on other threads than those that carry the
    /// streams, because there may be millions, and on half of the cores at most.
    async fn messages(
        &self,
        frame: &Arc<EncodedFrame>,
        dropped_count: u64,
    ) -> Result<Vec<S::Message>, Leave> {
        let kind = self.kind;
        if !kind.needed().covers(FieldSet::GRID) {
            return Ok(kind.messages(frame, dropped_count));
        }

        let _permit = self.feed.streams().choosing.acquire().await.map_err(|_closed| Leave::Quietly)?;
        let frame = Arc::clone(frame);
        let packed = tokio::task::spawn_blocking(move || kind.messages(&frame, dropped_count)).await;
        packed.map_err(|_panic| {
            Leave::With(ServiceError::internal(
                "packing the grid's nodes panicked: this is a bug in the server",
            ))
        })
    }
}

fn is_news(newest: &Newest, sent: Option<u64>, wanted: FieldSet) -> bool {
    sent != Some(newest.frame.head.frame) && newest.frame.fields().covers(wanted)
}

/// A feed lives as long as its watchers: its end would only mean that nothing more comes.
fn gone<T, E>(outcome: Result<T, E>) -> Result<(), Leave> {
    outcome.map(|_| ()).map_err(|_closed| Leave::Quietly)
}

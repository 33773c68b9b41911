//! The journal of a watcher, which checks each message for what every stream promises: ordered, unique, reliable,
//! resumable, bookmarkable, atomic.

use nappe_proto::v1::{
    self, ChangeKind, watch_diagnostics_response::Event as DiagnosticsEvent, watch_frames_response::Event,
};

/// A message of either kind of stream, as far as the promises go.
#[derive(Debug)]
pub(crate) enum Told {
    Topology,
    /// A piece of a frame, or the diagnostics of one.
    Piece {
        frame: u64,
        step: u64,
        chunk: v1::Chunk,
        dropped_count: u64,
    },
    Change(Box<v1::StateChange>),
    Progress(v1::Progress),
    End(v1::SessionEnd),
}

impl From<v1::WatchFramesResponse> for Told {
    fn from(message: v1::WatchFramesResponse) -> Self {
        match message.event.expect("an event") {
            Event::Topology(_) => Self::Topology,
            Event::Frame(v1::Frame { frame, step, chunk, dropped_count, .. }) => {
                Self::Piece { frame, step, chunk: chunk.expect("where it stands"), dropped_count }
            }
            Event::Change(change) => Self::Change(Box::new(change)),
            Event::Progress(progress) => Self::Progress(progress),
            Event::End(end) => Self::End(end),
        }
    }
}

impl From<v1::WatchDiagnosticsResponse> for Told {
    fn from(message: v1::WatchDiagnosticsResponse) -> Self {
        match message.event.expect("an event") {
            DiagnosticsEvent::Diagnostics(v1::Diagnostics { frame, step, .. }) => {
                let chunk = v1::Chunk { index: 0, count: 1 };
                Self::Piece { frame, step, chunk, dropped_count: message.dropped_count }
            }
            DiagnosticsEvent::Change(change) => Self::Change(Box::new(change)),
            DiagnosticsEvent::Progress(progress) => Self::Progress(progress),
            DiagnosticsEvent::End(end) => Self::End(end),
        }
    }
}

/// What a watcher has seen, over all streams that it opened one after the other.
#[derive(Debug, Default)]
pub(crate) struct Journal {
    pub(crate) is_every: bool,
    /// The newest whole frame, and how many came.
    pub(crate) last: Option<u64>,
    pub(crate) frame_count: u64,
    step: u64,
    /// Pieces that came of a frame: its number, how many, of how many.
    partial: Option<(u64, u32, u32)>,
    /// Whether a stream has just begun: LATEST counts no drops there.
    is_fresh: bool,
    pub(crate) changes: Vec<v1::StateChange>,
    /// Number of the newest change, and of the frame that it came after.
    change: u64,
    pub(crate) end: Option<v1::SessionEnd>,
}

impl Journal {
    /// Of a watcher that has seen nothing yet.
    pub(crate) fn new(delivery: v1::Delivery) -> Self {
        Self { is_every: delivery == v1::Delivery::Every, is_fresh: true, ..Self::default() }
    }

    /// A stream that broke; part of a frame that came is void.
    pub(crate) fn broke(&mut self) {
        (self.partial, self.is_fresh) = (None, true);
    }

    /// Checks the next message.
    pub(crate) fn read(&mut self, told: Told) {
        assert!(self.end.is_none(), "nothing follows the end: {told:?}");
        let Told::Piece { frame, step, chunk, dropped_count } = told else {
            // Atomic: the pieces of a frame follow each other.
            assert!(self.partial.is_none(), "within frame {:?} came {told:?}", self.partial);
            return self.read_between(told);
        };

        match self.partial {
            None => {
                assert_eq!(chunk.index, 0, "a frame begins with its first piece");
                self.begin(frame, step, dropped_count);
            }
            Some((number, received, count)) => {
                assert_eq!((frame, chunk.index, chunk.count), (number, received, count), "atomic");
            }
        }
        let received = chunk.index + 1;
        self.partial = (received < chunk.count).then_some((frame, received, chunk.count));
        if self.partial.is_none() {
            (self.last, self.is_fresh) = (Some(frame), false);
            self.frame_count += 1;
        }
    }

    fn begin(&mut self, frame: u64, step: u64, dropped_count: u64) {
        // Ordered and unique: numbers and steps only grow, also from stream to stream. Whoever watches the newest and
        // comes back is shown the newest again.
        let is_shown_again = self.is_fresh && !self.is_every && self.last == Some(frame);
        assert!(is_shown_again || self.last.is_none_or(|last| frame > last), "{frame} after {:?}", self.last);
        assert!(step >= self.step, "step {step} after {}", self.step);

        // Reliable: what is missing is counted. Resumable: nothing is missing for a watcher of every frame.
        if self.is_every {
            let next = self.last.map_or(0, |last| last + 1);
            assert_eq!((frame, dropped_count), (next, 0), "every frame comes");
        } else if !self.is_fresh {
            let gap = frame - self.last.expect("one came") - 1;
            assert_eq!(dropped_count, gap, "what was dropped is counted");
        }

        // A change comes before the frames that were made after it.
        if let Some(change) = self.changes.last().filter(|_| !self.is_fresh && self.is_every) {
            assert!(frame > change.frame, "frame {frame} after change {change:?}");
        }
        self.step = step;
    }

    fn read_between(&mut self, told: Told) {
        match told {
            Told::Topology => assert!(self.is_fresh, "the topology comes first"),
            Told::Change(change) if change.kind() == ChangeKind::Present => {
                assert!(change.number >= self.change, "how it stands is never older than what was told");
                self.change = change.number;
            }
            Told::Change(change) => {
                assert_eq!(change.number, self.change + 1, "every change comes, in order");
                assert!(self.is_fresh || self.last.is_none_or(|last| last <= change.frame), "{change:?}");
                if self.is_every && !self.is_fresh {
                    assert_eq!(self.last, Some(change.frame), "it comes right after its frame");
                }
                self.change = change.number;
                self.changes.push(*change);
            }
            // Bookmarkable: all up to the number was sent.
            Told::Progress(progress) => {
                if let Some(last) = self.last {
                    assert_eq!(progress.frame, last, "a bookmark stands at what was sent");
                }
            }
            Told::End(end) => {
                assert_eq!(self.last, Some(end.frame), "all frames come before the end");
                self.end = Some(end);
            }
            Told::Piece { .. } => unreachable!("it is read by `read`"),
        }
    }
}

//! Frames that a session keeps for watchers that lag or resume, within a budget of bytes.
//!
//! Enters: frames, one after the other. Leaves: a frame by its number, or which numbers are kept.

use std::{collections::VecDeque, sync::Arc};

use super::{fields::FieldSet, frame::EncodedFrame, memory::FrameMemory};

/// What a look into the history finds.
#[derive(Clone, Debug)]
pub(crate) enum Lookup {
    Found(Arc<EncodedFrame>),
    /// The frame is not made yet.
    NotYet,
    /// The frame is no longer kept, or not with what is asked for.
    Expired {
        /// Number of the oldest frame that is kept with what is asked for.
        oldest: u64,
    },
}

/// The first frames that watchers still need; the largest number if there is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Needed {
    /// Of a watcher that the session waits for: neither this frame nor a later one makes room.
    pub paced: u64,
    /// Of a watcher that is still receiving the topology: they stay within twice the budget.
    pub opening: u64,
}

/// Frames without gaps, oldest first; at least one once the first was pushed.
#[derive(Debug)]
pub(super) struct History {
    frames: VecDeque<Arc<EncodedFrame>>,
    /// For each part of a frame, the number from which on all frames have it; past the newest if that has it not.
    complete_from: [u64; FieldSet::PARTS],
    /// Memory of the frames (bytes).
    bytes: u64,
    budget: u64,
    memory: Arc<FrameMemory>,
}

impl History {
    /// An empty history that keeps up to `budget` bytes of frames, and always the newest.
    pub(super) fn new(budget: u64, memory: Arc<FrameMemory>) -> Self {
        Self { frames: VecDeque::new(), complete_from: [0; FieldSet::PARTS], bytes: 0, budget, memory }
    }

    /// Number of the oldest frame kept; 0 if there is none yet.
    pub(super) fn oldest(&self) -> u64 {
        self.frames.front().map_or(0, |frame| frame.head.frame)
    }

    /// Whether one more frame like the newest takes the place of none that the session waits for.
    pub(super) fn has_room(&self, needed: Needed) -> bool {
        let next = self.frames.back().map_or(0, |newest| newest.size() as u64);
        self.oldest() < needed.paced || self.bytes + next <= self.budget
    }

    /// Adds a frame, or replaces the newest if it has the same number. Returns the frames that made room for it.
    pub(super) fn push(&mut self, frame: Arc<EncodedFrame>, needed: Needed) -> Vec<Arc<EncodedFrame>> {
        let (number, held) = (frame.head.frame, frame.fields());
        let mut outdated = Vec::new();
        if let Some(newest) = self.frames.back() {
            // The first frame has every field until the second is made.
            let narrow = (newest.head.frame == 0 && number > 0).then(|| newest.only(held));
            if narrow.is_some() || newest.head.frame == number {
                outdated.extend(self.frames.pop_back());
            }
            if let Some(narrow) = narrow {
                self.keep(Arc::new(narrow));
            }
        }

        for (part, from) in self.complete_from.iter_mut().enumerate() {
            *from = if held.has_part(part) { (*from).min(number) } else { number + 1 };
        }

        self.keep(frame);
        for frame in &outdated {
            self.forget(frame);
        }

        while self.frames.len() > 1 {
            let budget = match self.oldest() {
                oldest if oldest >= needed.paced => break,
                oldest if oldest >= needed.opening => self.budget.saturating_mul(2),
                _ => self.budget,
            };
            if self.bytes <= budget {
                break;
            }
            let frame = self.frames.pop_front().expect("there is more than one");
            self.forget(&frame);
            outdated.push(frame);
        }
        outdated
    }

    fn keep(&mut self, frame: Arc<EncodedFrame>) {
        self.bytes += frame.size() as u64;
        self.memory.keep(frame.array_bytes() as u64);
        self.frames.push_back(frame);
    }

    fn forget(&mut self, frame: &EncodedFrame) {
        self.bytes -= frame.size() as u64;
        self.memory.let_go(frame.array_bytes() as u64);
    }

    /// Frame `number` if it holds what is `wanted`.
    pub(super) fn lookup(&self, number: u64, wanted: FieldSet) -> Lookup {
        if self.frames.back().is_none_or(|newest| newest.head.frame < number) {
            return Lookup::NotYet;
        }

        let found = number
            .checked_sub(self.oldest())
            .and_then(|index| self.frames.get(index as usize))
            .filter(|frame| frame.fields().covers(wanted));
        if let Some(frame) = found {
            return Lookup::Found(Arc::clone(frame));
        }

        let complete_from = self.complete_from.iter().enumerate();
        let oldest = complete_from
            .filter(|(part, _)| wanted.has_part(*part))
            .map(|(_, from)| *from)
            .fold(self.oldest(), u64::max);
        Lookup::Expired { oldest }
    }
}

impl Drop for History {
    fn drop(&mut self) {
        while let Some(frame) = self.frames.pop_front() {
            self.forget(&frame);
        }
    }
}

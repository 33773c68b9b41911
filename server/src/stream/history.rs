//! Frames that a session keeps for watchers that lag or resume, within a budget of bytes.
//!
//! Enters: frames, one after the other. Leaves: a frame by its number, or which numbers are kept.

use std::{collections::VecDeque, sync::Arc};

use super::{fields::FieldSet, frame::EncodedFrame};

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

/// Frames without gaps, oldest first; at least one once the first was pushed.
#[derive(Debug)]
pub(super) struct History {
    frames: VecDeque<Arc<EncodedFrame>>,
    /// For each part of a frame, the number from which on all frames have it; past the newest if that has it not.
    complete_from: [u64; FieldSet::PARTS],
    /// Memory of the frames (bytes).
    bytes: u64,
    budget: u64,
}

impl History {
    /// An empty history that keeps up to `budget` bytes of frames, and always the newest.
    pub(super) fn new(budget: u64) -> Self {
        Self { frames: VecDeque::new(), complete_from: [0; FieldSet::PARTS], bytes: 0, budget }
    }

    /// Number of the oldest frame kept; 0 if there is none yet.
    pub(super) fn oldest(&self) -> u64 {
        self.frames.front().map_or(0, |frame| frame.head.frame)
    }

    /// Adds a frame, or replaces the newest if it has the same number. Returns the frames that
    /// made room for it.
    pub(super) fn push(&mut self, frame: Arc<EncodedFrame>) -> Vec<Arc<EncodedFrame>> {
        let mut outdated = Vec::new();
        if self.frames.back().is_some_and(|newest| newest.head.frame == frame.head.frame) {
            outdated.extend(self.frames.pop_back());
        }

        let (number, held) = (frame.head.frame, frame.fields());
        for (part, from) in self.complete_from.iter_mut().enumerate() {
            *from = if held.has_part(part) { (*from).min(number) } else { number + 1 };
        }

        self.bytes += frame.size() as u64;
        self.frames.push_back(frame);
        self.bytes -= outdated.iter().map(|frame| frame.size() as u64).sum::<u64>();

        while self.bytes > self.budget && self.frames.len() > 1 {
            let frame = self.frames.pop_front().expect("there is more than one");
            self.bytes -= frame.size() as u64;
            outdated.push(frame);
        }
        outdated
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

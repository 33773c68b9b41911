//! How many calm windows in a row make a piece calm: twice as many, each time that a calm piece moved again.

use serde::{Deserialize, Serialize};

/// Calm windows in a row that are needed at first.
const FIRST: u32 = 3;
/// Those that are needed at most.
const MOST: u32 = 64;

/// Where a piece stands on its way to being calm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Ladder {
    /// Calm windows since the last one that was not, counted up to those that are needed.
    in_a_row: u32,
    /// Calm windows in a row that are needed.
    needed: u32,
}

impl Default for Ladder {
    fn default() -> Self {
        Self { in_a_row: 0, needed: FIRST }
    }
}

impl Ladder {
    /// Takes in a calm window.
    pub(super) fn rise(&mut self) {
        self.in_a_row = (self.in_a_row + 1).min(self.needed);
    }

    /// Takes in a window that was not calm.
    pub(super) fn fall(&mut self) {
        if self.is_calm() {
            self.needed = (2 * self.needed).min(MOST);
        }
        self.in_a_row = 0;
    }

    /// Forgets calm windows, where something else than the piece ended them.
    pub(super) fn begin_again(&mut self) {
        self.in_a_row = 0;
    }

    /// Whether windows can be counted on from here.
    pub(super) fn is_sound(self) -> bool {
        (FIRST..=MOST).contains(&self.needed) && self.in_a_row <= self.needed
    }

    /// Whether enough windows in a row were calm.
    pub(super) fn is_calm(self) -> bool {
        self.in_a_row == self.needed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Calm windows that a piece takes from here to being calm.
    fn windows_to_calm(ladder: &mut Ladder) -> u32 {
        let mut windows = 0;
        while !ladder.is_calm() {
            ladder.rise();
            windows += 1;
        }
        windows
    }

    #[test]
    fn each_time_that_calm_ends_twice_as_many_windows_are_needed_up_to_64() {
        let mut ladder = Ladder::default();
        for needed in [3, 6, 12, 24, 48, 64, 64] {
            assert_eq!(windows_to_calm(&mut ladder), needed);
            ladder.rise();
            assert!(ladder.is_calm(), "it stays calm");
            ladder.fall();
            assert!(!ladder.is_calm());
        }
    }

    #[test]
    fn what_something_else_wakes_needs_no_more_windows() {
        let mut ladder = Ladder::default();
        windows_to_calm(&mut ladder);
        ladder.begin_again();
        assert!(!ladder.is_calm());
        assert_eq!(windows_to_calm(&mut ladder), 3);
    }

    #[test]
    fn what_was_not_calm_yet_begins_again_with_as_many() {
        let mut ladder = Ladder::default();
        for _ in 0..10 {
            ladder.rise();
            ladder.rise();
            ladder.fall();
        }
        assert_eq!(windows_to_calm(&mut ladder), 3);
    }
}

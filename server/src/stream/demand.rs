//! What the present watchers of a session want of its frames.
//!
//! Enters: what a watcher wants, for as long as it watches. Leaves: what the next frame must hold. What nobody
//! wants any more is left out some seconds after the last who did is gone: whoever lost a connection and comes
//! back finds his frames complete.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use super::fields::FieldSet;

/// How long a part of frames is made after its last watcher has left.
pub(crate) const LINGER: Duration = Duration::from_secs(5);

/// Watchers of one part of frames.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    watchers: u32,
    /// When the last of them left.
    left: Option<Instant>,
}

/// What watchers want, part by part.
#[derive(Debug, Default)]
pub(crate) struct Demand {
    parts: Mutex<[Part; FieldSet::PARTS]>,
}

/// One watcher's share of the demand, until it is dropped.
#[derive(Debug)]
pub(crate) struct Wish {
    demand: Arc<Demand>,
    fields: FieldSet,
}

impl Demand {
    /// Asks for fields from now on; true if frames did not hold them.
    pub(crate) fn wish(self: &Arc<Self>, fields: FieldSet) -> (Wish, bool) {
        let is_new = !self.at(Instant::now()).covers(fields);
        for (_, part) in self.lock().iter_mut().enumerate().filter(|(part, _)| fields.has_part(*part)) {
            part.watchers += 1;
        }
        (Wish { demand: Arc::clone(self), fields }, is_new)
    }

    /// What a frame made at `now` must hold: what every frame has, and what is wanted.
    pub(crate) fn at(&self, now: Instant) -> FieldSet {
        let is_wanted = |part: &Part| {
            part.watchers > 0 || part.left.is_some_and(|left| now.saturating_duration_since(left) < LINGER)
        };
        let parts = *self.lock();
        let wanted = parts.iter().enumerate().filter(|(_, part)| is_wanted(part));
        wanted.fold(FieldSet::ALWAYS, |fields, (part, _)| fields.union(FieldSet::of_part(part)))
    }

    fn lock(&self) -> MutexGuard<'_, [Part; FieldSet::PARTS]> {
        // No code that holds the lock can leave it half changed.
        self.parts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Wish {
    fn drop(&mut self) {
        let fields = self.fields;
        for (_, part) in self.demand.lock().iter_mut().enumerate().filter(|(part, _)| fields.has_part(*part))
        {
            part.watchers -= 1;
            part.left = Some(Instant::now());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn demand_ends_some_seconds_after_the_last_watcher() {
        let demand = Arc::new(Demand::default());
        // A part that not every frame has.
        let wide = FieldSet::of_part(1);
        assert_eq!(demand.at(Instant::now()), FieldSet::ALWAYS);

        let (first, is_new) = demand.wish(wide);
        assert!(is_new);
        let (second, is_new) = demand.wish(wide.union(FieldSet::GRID));
        assert!(is_new, "the grid is");
        assert!(!demand.wish(wide).1, "it is wanted already");

        // However long the test is held up, this is a moment before he left.
        let before = Instant::now();
        drop(second);
        let later = Instant::now() + LINGER;
        assert_eq!(demand.at(later), FieldSet::ALWAYS.union(wide), "one watcher is left");
        assert!(demand.at(before + LINGER / 2).covers(FieldSet::GRID), "he may come back");

        drop(first);
        assert!(demand.at(before + LINGER / 2).covers(wide), "he may come back too");
        assert_eq!(demand.at(Instant::now() + LINGER), FieldSet::ALWAYS);
    }
}

//! A session that is handed to ranks, and one that has lost them.

use std::sync::Arc;

use nappe_sim::interrupt::Interrupt;

use super::{
    ranks::{Begin, RankCounts, Ranks, Watched},
    simulator::Behind,
    stepper::Stepper,
};
use crate::{config::RankSettings, error::ServiceError};

impl Stepper {
    /// Has ranks step it from here, which start now; the strings are their warnings.
    ///
    /// # Errors
    /// When they do not start, or the server has no memory left for them.
    pub(super) fn hand_to_ranks(
        &mut self,
        settings: &RankSettings,
        counts: RankCounts,
        begin: &Begin<'_>,
        start: &Interrupt,
    ) -> Result<Vec<String>, ServiceError> {
        let [control, deleted] = [(); 2].map(|()| Arc::clone(&self.control));
        let watched = Watched {
            start: start.clone(),
            steps: self.simulator.simulation.interrupt().clone(),
            is_deleted: Box::new(move || deleted.is_deleted()),
            on_end: Box::new(move || control.lose_ranks()),
        };
        let (memory, bytes) = (&self.simulator.memory, self.status().properties.claimed_bytes);
        // Each has the whole scene.
        let count = |here: u64| memory.grow(bytes.saturating_mul(here));
        let (ranks, warnings) = Ranks::start(settings, counts, begin, watched, count)?;
        self.status().update(|progress| progress.ranks = Some(ranks.describe()));
        self.simulator.ranks = Some(ranks);
        Ok(warnings)
    }

    /// Fails the session, whose ranks have ended.
    pub(super) fn lose_ranks(&mut self) {
        if let Some(ranks) = &mut self.simulator.ranks {
            let lost = ranks.lost(&"the launcher ended");
            self.simulator.is_torn |= self.simulator.behind > Behind::Nothing;
            self.fail(lost, self.step_count(), None, None);
        }
    }
}

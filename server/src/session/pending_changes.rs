//! Changes of parameters that wait for their step.

use std::collections::BTreeMap;

use nappe_sim::world::Change;

use crate::error::{Reason, ServiceError};

/// Groups of changes by the step before which they take effect, bounded in number.
#[derive(Debug)]
pub(super) struct PendingChanges {
    groups: BTreeMap<u64, Vec<Vec<Change>>>,
    /// Changes in all groups.
    count: usize,
    limit: usize,
}

impl PendingChanges {
    /// An empty queue of at most `limit` changes.
    pub(super) fn new(limit: u32) -> Self {
        Self { groups: BTreeMap::new(), count: 0, limit: limit as usize }
    }

    /// Queues a group before step `step`; groups of one step take effect in the order they came.
    pub(super) fn push(&mut self, step: u64, changes: Vec<Change>) -> Result<(), ServiceError> {
        let (count, limit) = (self.count + changes.len(), self.limit);
        if count > limit {
            let message = format!("{count} changes would wait for their step; allowed: at most {limit}");
            return Err(ServiceError::new(Reason::TooManyChanges, message)
                .with("changes", count)
                .with("allowed", limit));
        }

        self.count = count;
        self.groups.entry(step).or_default().push(changes);
        Ok(())
    }

    /// Takes the groups due before step `step`, in order.
    pub(super) fn take_due(&mut self, step: u64) -> Vec<Vec<Change>> {
        let mut due = Vec::new();
        while let Some(entry) = self.groups.first_entry()
            && *entry.key() <= step
        {
            due.extend(entry.remove());
        }

        self.count -= due.iter().map(Vec::len).sum::<usize>();
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_come_in_the_order_of_steps_and_are_bounded() {
        let mut pending = PendingChanges::new(3);
        let drag = |value| vec![Change::Drag(value)];
        pending.push(5, drag(1.0)).expect("room");
        pending.push(2, drag(2.0)).expect("room");
        pending.push(5, drag(3.0)).expect("room");
        assert_eq!(pending.push(9, drag(4.0)).expect_err("full").reason, Reason::TooManyChanges);
        assert!(pending.take_due(1).is_empty());
        assert_eq!(pending.take_due(5), [drag(2.0), drag(1.0), drag(3.0)]);
        pending.push(9, drag(4.0)).expect("room again");
    }
}

//! Changes of parameters that wait for their step.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Bound::{Excluded, Unbounded},
};

use nappe_sim::world::Change;

use crate::{
    error::{Reason, ServiceError},
    memory::Claim,
    state::{PendingGroup, Waiting},
};

/// Changes in a page, unless the first call of it has more: with lists of a KiB each, an answer stays below 4 MiB.
const PAGE_CHANGES: usize = 2048;

/// Where changes stand among all that a session applies: first by step, then by order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Accepted {
    /// Index of the step before which they take effect.
    pub step: u64,
    /// Counts the calls that changed the session, from 1.
    pub order: u64,
}

/// Changes of one call, which wait.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PendingChange {
    pub accepted: Accepted,
    pub changes: Vec<Change>,
}

/// Memory of a group beside that of its changes (bytes).
const GROUP_BYTES: usize = 100;

/// Changes that wait: groups of them, one per call, bounded in number, and counted as memory of the server until they are taken.
#[derive(Debug)]
pub(super) struct PendingChanges {
    queue: Queue,
    memory: Claim,
}

/// Groups of changes. A copy of them is counted by nobody.
#[derive(Clone, Debug)]
pub(super) struct Queue {
    groups: BTreeMap<Accepted, Vec<Change>>,
    /// Changes in all groups.
    count: usize,
    /// Memory of all groups (bytes).
    bytes: u64,
    limit: usize,
    /// Groups taken so far.
    last_order: u64,
}

impl PendingChanges {
    /// An empty queue of at most `limit` changes, whose memory `memory` counts.
    pub(super) fn new(limit: u32, memory: Claim) -> Self {
        let limit = limit as usize;
        Self { queue: Queue { groups: BTreeMap::new(), count: 0, bytes: 0, limit, last_order: 0 }, memory }
    }

    /// The queue of another session, for a copy of that.
    ///
    /// # Errors
    /// If the server has not as much memory left.
    pub(super) fn of(queue: Queue, memory: Claim) -> Result<Self, ServiceError> {
        memory.grow(queue.bytes)?;
        Ok(Self { queue, memory })
    }

    /// The queue of a session that goes on from a file: groups of at most `limit` changes, after so many calls.
    ///
    /// # Errors
    /// If too many changes wait, or the server has not as much memory left.
    pub(super) fn restored(waiting: Waiting, limit: u32, memory: Claim) -> Result<Self, ServiceError> {
        let mut pending = Self::new(limit, memory);
        for PendingGroup { step, order, changes } in waiting.groups {
            // Each has its place among all calls, which is the next one for a moment.
            pending.queue.last_order = order.saturating_sub(1);
            pending.push(step, changes)?;
        }
        pending.queue.last_order = waiting.last_order;
        Ok(pending)
    }

    /// The same of a session that its server kept: with those that it had made since, there may be more of them for a while.
    ///
    /// # Errors
    /// If the server has not as much memory left.
    pub(super) fn replayed(waiting: Waiting, limit: u32, memory: Claim) -> Result<Self, ServiceError> {
        let mut pending = Self::restored(waiting, u32::MAX, memory)?;
        pending.queue.limit = limit as usize;
        Ok(pending)
    }

    /// The changes that wait, in the order in which they take effect.
    pub(super) fn queue(&self) -> &Queue {
        &self.queue
    }

    /// Queues a group before step `step`; groups of one step take effect in the order they came.
    ///
    /// # Errors
    /// If too many changes wait, or the server has no memory for them.
    pub(super) fn push(&mut self, step: u64, mut changes: Vec<Change>) -> Result<Accepted, ServiceError> {
        changes.shrink_to_fit();
        let Queue { count, limit, .. } = self.queue;
        let count = count + weight(&changes);
        if count > limit {
            let message = format!("{count} changes would wait for their step; allowed: at most {limit}");
            return Err(ServiceError::new(Reason::TooManyChanges, message)
                .with("changes", count)
                .with("allowed", limit));
        }
        self.memory.grow(bytes(&changes))?;

        self.queue.count = count;
        self.queue.bytes += bytes(&changes);
        let accepted = self.count_call(step);
        self.queue.groups.insert(accepted, changes);
        Ok(accepted)
    }

    /// Counts a call that changes the session, before step `step`.
    pub(super) fn count_call(&mut self, step: u64) -> Accepted {
        self.queue.last_order += 1;
        Accepted { step, order: self.queue.last_order }
    }

    /// Takes the groups due before step `step`, in order.
    pub(super) fn take_due(&mut self, step: u64) -> Vec<Vec<Change>> {
        let due = self.queue.take_due(step);
        self.memory.shrink_to(self.queue.bytes);
        due
    }

    /// Drops the groups of these orders after a place; `None`: all. Returns the orders of those that there were.
    pub(super) fn drop_groups(&mut self, after: Option<Accepted>, orders: Option<&[u64]>) -> Vec<u64> {
        let dropped = self.queue.drop_groups(after, orders);
        self.memory.shrink_to(self.queue.bytes);
        dropped
    }
}

impl Queue {
    /// Memory of all groups (bytes).
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Its groups as a file has them.
    pub(super) fn into_waiting(self) -> Waiting {
        let group = |(Accepted { step, order }, changes)| PendingGroup { step, order, changes };
        Waiting { groups: self.groups.into_iter().map(group).collect(), last_order: self.last_order }
    }

    /// The changes of a call, if they wait.
    pub(super) fn group(&self, accepted: Accepted) -> Option<&[Change]> {
        self.groups.get(&accepted).map(Vec::as_slice)
    }

    /// How many changes wait.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Names of the colliders that they move.
    pub(super) fn moved(&self) -> BTreeSet<&str> {
        let moves = self.groups.values().flatten().filter_map(|change| match change {
            Change::Collider(asked) => Some(asked.collider.as_str()),
            _ => None,
        });
        moves.collect()
    }

    /// States that are put before step `step`, in the order in which they take effect.
    pub(super) fn states_due(&self, step: u64) -> impl Iterator<Item = &Change> {
        let due = self.groups.iter().take_while(move |(accepted, _)| accepted.step <= step);
        due.flat_map(|(_, changes)| changes).filter(|change| matches!(change, Change::State { .. }))
    }

    fn take_due(&mut self, step: u64) -> Vec<Vec<Change>> {
        let mut due = Vec::new();
        while let Some(entry) = self.groups.first_entry()
            && entry.key().step <= step
        {
            due.push(entry.remove());
        }

        self.count -= due.iter().map(|changes| weight(changes)).sum::<usize>();
        self.bytes -= due.iter().map(|changes| bytes(changes)).sum::<u64>();
        due
    }

    /// Up to `count` groups after one, in the order in which they take effect, and the last of them if more follow. Fewer where
    /// they have many changes.
    pub(super) fn page(
        &self,
        after: Option<Accepted>,
        count: usize,
    ) -> (Vec<PendingChange>, Option<Accepted>) {
        let from = after.map_or(Unbounded, Excluded);
        let mut left = self.groups.range((from, Unbounded)).peekable();
        let (mut page, mut room) = (Vec::new(), PAGE_CHANGES);
        while page.len() < count
            && let Some((accepted, changes)) =
                left.next_if(|(_, changes)| page.is_empty() || weight(changes) <= room)
        {
            room = room.saturating_sub(weight(changes));
            page.push(PendingChange { accepted: *accepted, changes: changes.clone() });
        }
        let last = page.last().map(|group| group.accepted);
        (page, left.next().and(last))
    }

    fn drop_groups(&mut self, after: Option<Accepted>, orders: Option<&[u64]>) -> Vec<u64> {
        let from = after.map_or(Unbounded, Excluded);
        let is_named = |accepted: &Accepted| orders.is_none_or(|orders| orders.contains(&accepted.order));
        let dropped = self.groups.extract_if((from, Unbounded), |accepted, _| is_named(accepted));
        let dropped = dropped.map(|(accepted, _)| accepted.order).collect();
        self.count = self.groups.values().map(|changes| weight(changes)).sum();
        self.bytes = self.groups.values().map(|changes| bytes(changes)).sum();
        dropped
    }
}

/// Changes in a group, each point of a path counted as one.
fn weight(changes: &[Change]) -> usize {
    changes.iter().map(Change::weight).sum()
}

/// Memory of a group (bytes).
fn bytes(changes: &[Change]) -> u64 {
    (GROUP_BYTES + changes.iter().map(Change::bytes).sum::<usize>()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::MemoryAccount;

    /// An empty queue on a server with room for everything.
    fn queue(limit: u32) -> PendingChanges {
        PendingChanges::new(limit, MemoryAccount::of_server(1 << 30).claim())
    }

    #[test]
    fn what_waits_counts_as_memory_until_it_is_taken_or_dropped() {
        let account = MemoryAccount::of_server(21_000);
        let mut pending = PendingChanges::new(1000, account.claim());
        let path = |points: usize| {
            vec![Change::PinPath { particle: 0, points: vec![(1.0, [0.0; 3]); points].into() }]
        };
        let of_lists = |points: u64| 32 * points;
        pending.push(3, path(100)).expect("room");
        pending.push(5, path(200)).expect("room");
        let used = account.used();
        assert!((of_lists(300)..of_lists(300) + 600).contains(&used), "{used}");
        let full = pending.push(7, path(400)).expect_err("no memory");
        assert_eq!((full.reason, account.used()), (Reason::ServerMemoryFull, used), "nothing is taken");
        assert_eq!(pending.push(7, path(800)).expect_err("too many").reason, Reason::TooManyChanges);

        // A copy counts once more, where there is room.
        let copy = PendingChanges::of(pending.queue().clone(), account.claim()).expect("room");
        assert_eq!(account.used(), 2 * used);
        PendingChanges::of(pending.queue().clone(), account.claim()).expect_err("no memory");
        drop(copy);

        assert_eq!(pending.take_due(3).len(), 1);
        let left = account.used();
        assert!((of_lists(200)..of_lists(200) + 300).contains(&left), "{left}");
        assert!(pending.drop_groups(None, Some(&[9])).is_empty());
        assert_eq!(account.used(), left);
        assert_eq!(pending.drop_groups(None, None), [2]);
        assert_eq!(account.used(), 0);
        pending.push(9, path(400)).expect("room again");
        drop(pending);
        assert_eq!(account.used(), 0);
    }

    #[test]
    fn a_queue_that_was_saved_is_the_same_and_goes_on_counting() {
        let mut pending = queue(9);
        for step in [5, 2, 5] {
            pending.push(step, vec![Change::Drag(step as f64)]).expect("room");
        }
        assert_eq!(pending.drop_groups(None, Some(&[1])), [1]);
        let (bytes, saved) = (pending.queue().bytes(), pending.queue().clone().into_waiting());
        let places: Vec<_> = saved.groups.iter().map(|group| (group.step, group.order)).collect();
        assert_eq!((places, saved.last_order), (vec![(2, 2), (5, 3)], 3));

        let account = MemoryAccount::of_server(1 << 30);
        let few = PendingChanges::restored(saved.clone(), 1, account.claim()).expect_err("one is allowed");
        assert_eq!((few.reason, account.used()), (Reason::TooManyChanges, 0));
        let mut restored = PendingChanges::restored(saved.clone(), 9, account.claim()).expect("room");
        assert_eq!(restored.queue().clone().into_waiting(), saved);
        assert_eq!((restored.queue().count(), account.used()), (2, bytes));
        assert_eq!(restored.push(5, Vec::new()).expect("room"), Accepted { step: 5, order: 4 });
        assert_eq!(restored.take_due(2), [vec![Change::Drag(2.0)]]);

        let mut replayed = PendingChanges::replayed(saved, 1, account.claim()).expect("room");
        assert_eq!(
            replayed.push(5, vec![Change::Drag(0.0)]).expect_err("full").reason,
            Reason::TooManyChanges
        );
        assert_eq!(replayed.take_due(5).len(), 2);
        replayed.push(6, vec![Change::Drag(0.0)]).expect("room again");
    }

    #[test]
    fn groups_come_in_the_order_of_steps_and_are_bounded() {
        let mut pending = queue(3);
        let drag = |value| vec![Change::Drag(value)];
        pending.push(5, drag(1.0)).expect("room");
        pending.push(2, drag(2.0)).expect("room");
        pending.push(5, drag(3.0)).expect("room");
        assert_eq!(pending.push(9, drag(4.0)).expect_err("full").reason, Reason::TooManyChanges);
        assert!(pending.take_due(1).is_empty());
        assert_eq!(pending.take_due(5), [drag(2.0), drag(1.0), drag(3.0)]);
        assert_eq!(pending.push(9, drag(4.0)).expect("room again"), Accepted { step: 9, order: 4 });
    }

    #[test]
    fn groups_are_listed_in_order_and_dropped_by_their_order() {
        let mut pending = queue(9);
        for step in [5, 2, 5, 7] {
            pending.push(step, vec![Change::Drag(0.0)]).expect("room");
        }
        let orders =
            |page: &[PendingChange]| page.iter().map(|group| group.accepted.order).collect::<Vec<_>>();
        let (page, more) = pending.queue().page(None, 3);
        assert_eq!((orders(&page), more), (vec![2, 1, 3], Some(Accepted { step: 5, order: 3 })));
        let (page, more) = pending.queue().page(Some(page[2].accepted), 3);
        assert_eq!((orders(&page), more), (vec![4], None));

        // Lists of a KiB and more: a page holds as many as an answer has room for, and one at least.
        let list = |kibibytes: usize| Change::State {
            body: "b".to_owned(),
            positions: vec![[0.0; 3]; 1024 * kibibytes / 24].into(),
            velocities: None,
        };
        let mut large = queue(10_000);
        for kibibytes in [3000, 1000, 1000, 100] {
            large.push(1, vec![list(kibibytes)]).expect("room");
        }
        let (page, more) = large.queue().page(None, 9);
        assert_eq!((orders(&page), more), (vec![1], Some(Accepted { step: 1, order: 1 })));
        let (page, more) = large.queue().page(more, 9);
        assert_eq!((orders(&page), more), (vec![2, 3], Some(Accepted { step: 1, order: 3 })));
        let (page, more) = large.queue().page(more, 9);
        assert_eq!((orders(&page), more), (vec![4], None));

        assert_eq!(pending.drop_groups(None, Some(&[3, 1, 99])), [1, 3]);
        assert_eq!(orders(&pending.queue().page(None, 9).0), [2, 4]);
        let made = Some(Accepted { step: 6, order: u64::MAX });
        assert_eq!(pending.drop_groups(made, None), [4], "what is made again stays");
        pending.push(7, vec![Change::Drag(0.0)]).expect("room");
        assert_eq!(pending.drop_groups(None, None), [2, 5]);
        assert_eq!(pending.queue().count(), 0);
    }
}

//! Changes of a session's state on their way to its watchers.
//!
//! Enters: what happened to the session. Leaves: numbered messages, of which the newest are kept, so that a watcher
//! who was busy with a frame gets those that came meanwhile.

use std::collections::VecDeque;

use nappe_proto::v1;

/// Changes that are kept for watchers that are behind. Whoever is further behind sees a gap in their numbers.
const KEPT_CHANGES: usize = 256;

/// The newest changes of a session, and how it stands.
#[derive(Debug)]
pub(super) struct Changes {
    kept: VecDeque<v1::StateChange>,
    /// How the session stands since the last change.
    present: v1::StateChange,
}

impl Changes {
    /// None yet: the session of this uid is paused before its first step.
    pub(super) fn new(session_uid: String) -> Self {
        let mut present = v1::StateChange { session_uid, ..v1::StateChange::default() };
        present.set_kind(v1::ChangeKind::Present);
        present.set_state(v1::SessionState::Paused);
        Self { kept: VecDeque::new(), present }
    }

    /// How the session stands.
    pub(super) fn present(&self) -> &v1::StateChange {
        &self.present
    }

    /// Adds a change, whose number and uid are set here; returns the number.
    pub(super) fn push(&mut self, mut change: v1::StateChange) -> u64 {
        change.number = self.present.number + 1;
        change.session_uid.clone_from(&self.present.session_uid);
        self.present = change.clone();
        self.present.set_kind(v1::ChangeKind::Present);
        self.present.notice.clear();
        self.present.rejected = None;

        self.kept.push_back(change);
        if self.kept.len() > KEPT_CHANGES {
            self.kept.pop_front();
        }
        self.present.number
    }

    /// Changes after number `after`, up to number `newest`, as far as they are kept.
    pub(super) fn between(&self, after: u64, newest: u64) -> Vec<v1::StateChange> {
        let asked = |change: &&v1::StateChange| change.number > after && change.number <= newest;
        self.kept.iter().filter(asked).cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_numbered_and_the_newest_are_kept() {
        let mut changes = Changes::new("uid".to_owned());
        assert_eq!((changes.present().number, changes.present().kind()), (0, v1::ChangeKind::Present));

        for step in 1..=300 {
            let mut change = v1::StateChange { step, ..v1::StateChange::default() };
            change.set_kind(v1::ChangeKind::Parameters);
            assert_eq!(changes.push(change), step);
        }
        let numbers = |after, newest| -> Vec<u64> {
            changes.between(after, newest).iter().map(|change| change.number).collect()
        };
        assert_eq!(numbers(297, 299), [298, 299]);
        assert_eq!(numbers(0, 46), [45, 46], "the first are gone, and their numbers tell");
        assert_eq!((changes.present().step, changes.present().kind()), (300, v1::ChangeKind::Present));
        assert_eq!(changes.present().session_uid, "uid");
    }
}

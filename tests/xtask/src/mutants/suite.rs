//! The suites: the mutants of one part of the numerics, and the tests that are to notice them.

use super::{cloth, patch::Patch, snow, surface};

/// Mutants that one page tells of.
pub(super) struct Suite {
    /// What the page and the list call it.
    pub(super) name: &'static str,
    /// Page of the table, from the root.
    pub(super) page: &'static str,
    /// Folder of the patched files, from the root.
    pub(super) folder: &'static str,
    /// Number of the first mutant; the others follow in the order of `names`.
    pub(super) first: u32,
    /// What each mutant does wrong.
    pub(super) names: &'static [&'static str],
    /// The patches that make them.
    pub(super) patches: &'static [Patch],
    /// Suites of `tests/` that are run.
    pub(super) binaries: &'static [&'static str],
    /// Parts of the names of tests, of which one that is run has at least one; all are run where there is none.
    pub(super) only: &'static [&'static str],
    /// Parts of the names of tests that are left out: long runs, which say little that quick ones do not.
    pub(super) slow: &'static [&'static str],
}

/// The suites in the order in which they are run.
pub(super) const SUITES: [Suite; 3] = [
    Suite {
        name: "cloth",
        page: "docs/laws/cloth-mutants.md",
        folder: "server/sim/src",
        first: 101,
        names: &cloth::NAMES,
        patches: &cloth::PATCHES,
        binaries: &["cloth", "linalg", "determinism"],
        only: &[],
        slow: &cloth::SLOW,
    },
    Suite {
        name: "surfaces",
        page: "docs/laws/surface-mutants.md",
        folder: "server/sim/src",
        first: 201,
        names: &surface::NAMES,
        patches: &surface::PATCHES,
        binaries: &["cloth"],
        only: &surface::ONLY,
        slow: &surface::SLOW,
    },
    Suite {
        name: "snow",
        page: "docs/laws/snow-mutants.md",
        folder: "server/sim/src/snow",
        first: 1,
        names: &snow::NAMES,
        patches: &snow::PATCHES,
        binaries: &["snow"],
        only: &[],
        slow: &snow::SLOW,
    },
];

impl Suite {
    /// Numbers and names of its mutants.
    pub(super) fn mutants(&self) -> impl Iterator<Item = (u32, &'static str)> {
        (self.first..).zip(self.names.iter().copied())
    }
}

#[test]
fn every_mutant_has_a_number_and_a_patch_of_its_own() {
    let mut numbers: Vec<_> = SUITES.iter().flat_map(Suite::mutants).map(|(number, _)| number).collect();
    numbers.sort_unstable();
    let count = numbers.len();
    numbers.dedup();
    assert_eq!(numbers.len(), count, "two mutants share a number");
    for suite in &SUITES {
        for (number, name) in suite.mutants() {
            let made = |patch: &Patch| patch.mutant == number || patch.asks_for(number);
            assert!(suite.patches.iter().any(made), "nothing makes mutant {number}, {name}");
        }
        let last = suite.first + suite.names.len() as u32;
        let named = |patch: &Patch| patch.mutant == 0 || (suite.first..last).contains(&patch.mutant);
        assert!(suite.patches.iter().all(named), "a patch of {} makes a mutant without a name", suite.name);
    }
}

//! Every reason has a name of its own, and every name its reason.

use std::collections::BTreeSet;

use nappe_proto::Reason;

#[test] // AIP-193: [A-Z][A-Z0-9_]+[A-Z0-9], at most 63 characters
fn every_reason_has_its_own_well_formed_name() {
    let names: BTreeSet<&str> = Reason::ALL.iter().map(|reason| reason.name()).collect();
    assert_eq!(names.len(), Reason::ALL.len());
    for name in names {
        assert!((3..=63).contains(&name.len()), "{name}");
        assert!(name.chars().all(|c| c.is_ascii_uppercase() || c == '_'), "{name}");
        assert!(!name.starts_with('_') && !name.ends_with('_'), "{name}");
    }
}

#[test]
fn a_word_has_its_reason_and_an_unknown_one_none() {
    for reason in Reason::ALL {
        assert_eq!(Reason::of(reason.name()), Some(*reason));
    }
    assert_eq!(Reason::of("OF_A_NEWER_SERVER"), None);
}

//! Every way into the workspace builds each crate once: all must ask for the same features of what they share, or the
//! numerics would be compiled twice. And what is built for slow tests alone is run by the second tier.
//!
//! The command, the server, the ranks and the tests each select crates of their own, and cargo gives a crate the features
//! that all selected ones ask for. Where a selection would ask for more, the manifest of a crate that all share names the
//! dependency for its features alone, a pin. The viewer is outside: its SDK asks for features of some thirty crates.

use std::collections::BTreeSet;

use crate::{assert_none, tree};

/// The README's first command.
const FIRST: (&str, &[&str]) = ("the command", &["-p", "nappe-cli"]);

/// Every other way in, with the kinds of dependencies that it builds beside what it links.
const WAYS: [(&str, &[&str], &str); 4] = [
    ("the server", &["-p", "nappe-server"], ""),
    ("the workspace", &[], ""),
    ("ranks", &["--features", "nappe-cluster/mpi"], ""),
    ("tests", &[], ",dev"),
];

/// The crates that have features of their own in some way in, on purpose: the program of ranks links MPI.
const APART: [&str; 1] = ["nappe-cluster "];

/// Dependencies that a manifest names for their features alone.
const PINS: [&str; 3] = ["crc32fast", "regex-syntax", "simd-adler32"];

/// Crates with their features, a line each, as cargo resolves them for `selection`.
fn features(selection: &[&str], kinds: &str) -> BTreeSet<String> {
    let mut arguments = vec!["tree", "--offline", "--prefix", "none", "-f", "{p} [{f}]", "-e", kinds];
    arguments.extend(selection);
    let listing = tree::run(env!("CARGO"), &arguments);
    listing
        .lines()
        .map(|line| line.trim_end_matches(" (*)").to_owned())
        .filter(|line| !line.is_empty())
        .collect()
}

/// The crate of a line: name and version.
fn package(line: &str) -> &str {
    line.split(" [").next().unwrap_or(line)
}

/// Crates that two ways in share with different features. A crate may be there twice, linked and in what runs while building;
/// then one way may lack one of both.
fn against_second_builds(first: &BTreeSet<String>, way: &BTreeSet<String>, title: &str) -> Vec<String> {
    let of = |set: &BTreeSet<String>, name: &str| -> BTreeSet<String> {
        set.iter().filter(|line| package(line) == name).cloned().collect()
    };
    let shared: BTreeSet<_> = first.iter().map(|line| package(line)).collect();
    let is_built_twice = |name: &&str| {
        let (a, b) = (of(first, name), of(way, name));
        !b.is_empty() && !a.is_subset(&b) && !b.is_subset(&a)
    };
    let apart = |name: &&str| APART.iter().any(|crate_| name.starts_with(crate_));
    shared
        .into_iter()
        .filter(|name| !apart(name))
        .filter(is_built_twice)
        .map(|name| format!("{title}: {:?}, and of the command {:?}", of(way, name), of(first, name)))
        .collect()
}

#[test]
fn every_way_in_shares_one_build() {
    let (_, selection) = FIRST;
    // What is linked, and then what is linked or runs while building.
    for kinds in ["normal,no-proc-macro", "normal,build"] {
        let first = features(selection, kinds);
        assert!(first.len() > 100, "the command has dependencies");
        for (title, selection, more) in WAYS {
            let way = features(selection, &format!("{kinds}{more}"));
            assert_none(&against_second_builds(&first, &way, title));
        }
    }
}

/// Pins that nothing but a crate of the workspace depends on: without it there would be no crate to pin.
fn against_idle_pins(parents: impl Fn(&str) -> String) -> Vec<String> {
    let is_idle = |pin: &&str| {
        let tree = parents(pin);
        // The pin itself stands in the first line.
        !tree.lines().skip(1).any(|line| !line.is_empty() && !line.starts_with("nappe-"))
    };
    PINS.into_iter()
        .filter(is_idle)
        .map(|pin| format!("{pin}: nobody else links it: no pin is needed"))
        .collect()
}

#[test]
fn every_pin_is_of_a_crate_that_others_link() {
    let parents = |pin: &str| {
        let arguments =
            ["tree", "--offline", "-e", "normal,dev", "--prefix", "none", "--depth", "1", "-i", pin];
        tree::run(env!("CARGO"), &arguments)
    };
    assert_none(&against_idle_pins(parents));
    assert_eq!(against_idle_pins(|pin| format!("{pin} v1\nnappe-server v0.1.0\n")).len(), PINS.len());
}

#[test]
fn the_rule_finds_what_it_is_for() {
    let set = |lines: &[&str]| lines.iter().map(|line| (*line).to_owned()).collect();
    let first = set(&["a v1 [std]", "b v1 []"]);
    assert_none(&against_second_builds(&first, &set(&["a v1 [std]", "c v1 [x]"]), "x"));
    assert_none(&against_second_builds(&first, &set(&["a v1 [std]", "a v1 []"]), "x"));
    let found = against_second_builds(&first, &set(&["a v1 [fs,std]"]), "x");
    assert!(found.len() == 1 && found[0].contains("a v1 [fs,std]"), "{found:?}");
}

/// Suites behind the feature `slow` that the second tier of checks does not name: nobody would run them.
fn against_unproven(manifest: &str, prove: &str) -> Vec<String> {
    let suites = manifest.split("[[test]]").filter(|suite| suite.contains("required-features = [\"slow\"]"));
    let name = |suite: &str| suite.split("name = \"").nth(1)?.split('"').next().map(str::to_owned);
    let is_missing = |name: &String| !prove.contains(&format!("\"{name}\""));
    suites
        .filter_map(name)
        .filter(is_missing)
        .map(|name| format!("tests/xtask/src/prove.rs does not run {name}"))
        .collect()
}

#[test]
fn every_slow_suite_is_run_by_the_second_tier() {
    let [manifest, prove] = ["tests/Cargo.toml", "tests/xtask/src/prove.rs"].map(tree::text);
    assert_none(&against_unproven(&manifest, &prove));
    let suite = "[[test]]\nname = \"ice_slow\"\nrequired-features = [\"slow\"]\n\n[[test]]\nname = \"ice\"\n";
    assert_eq!(against_unproven(suite, &prove), ["tests/xtask/src/prove.rs does not run ice_slow"]);
    assert!(manifest.contains("required-features = [\"slow\"]"), "there are slow suites");
}

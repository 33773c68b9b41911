//! One build serves the programs and their tests: both must ask for the same features of every crate they share, or
//! the numerics would be compiled twice. And what is built for slow tests alone is run by the second tier.
//!
//! `cargo nappe` selects the command within the whole workspace (`--bin nappe`), so that cargo gives each crate the features that
//! all members ask for, as it does for tests. With `--package nappe-cli` the first build was 9 % shorter (168 s
//! and not 184 s, from an empty cargo home), but `cargo xtask test` then built sixteen crates anew, and with them all above them.

use std::collections::BTreeSet;

use crate::{assert_none, tree};

/// Crates that the tests link themselves, and the program only into macros: small, and built apart.
const APART: [&str; 1] = ["proc-macro2 "];

/// Crates with their features, a line each, as cargo resolves them for `selection`.
fn features(selection: &[&str]) -> BTreeSet<String> {
    let mut arguments = vec!["tree", "--offline", "--prefix", "none", "-f", "{p} [{f}]"];
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

/// Crates that the program and the tests share with different features.
fn against_second_builds(program: &BTreeSet<String>, tests: &BTreeSet<String>) -> Vec<String> {
    let shared: BTreeSet<_> = program.iter().map(|line| package(line)).collect();
    let apart = |line: &str| APART.iter().any(|name| line.starts_with(name));
    let other = |line: &&String| shared.contains(package(line)) && !program.contains(*line) && !apart(line);
    tests.iter().filter(other).map(|line| format!("only the tests ask for: {line}")).collect()
}

#[test]
fn the_program_and_its_tests_share_one_build() {
    // What is linked, and then what is linked or runs while building: a crate may be in both.
    for [of_program, of_tests] in
        [["normal,no-proc-macro", "normal,dev,no-proc-macro"], ["normal,build", "normal,build,dev"]]
    {
        let program = features(&["--workspace", "-e", of_program]);
        let tests = features(&["--workspace", "-e", of_tests]);
        assert!(program.len() > 100, "the program has dependencies");
        assert_none(&against_second_builds(&program, &tests));
    }
}

/// Whether `cargo nappe` takes the command out of the workspace, where its crates have other features.
fn leaves_the_workspace(config: &str) -> bool {
    let alias = config.lines().find(|line| line.starts_with("nappe = "));
    !alias.is_some_and(|alias| alias.contains("--bin nappe") && !alias.contains("-p"))
}

#[test]
fn the_command_is_built_with_the_features_of_the_whole_workspace() {
    assert!(!leaves_the_workspace(&tree::text(".cargo/config.toml")));
    assert!(leaves_the_workspace("nappe = \"run --release --package nappe-cli --\""));
    assert!(leaves_the_workspace("nappe = \"run --release -p nappe-cli --bin nappe --\""));
}

#[test]
fn the_rule_finds_what_it_is_for() {
    let set = |lines: &[&str]| lines.iter().map(|line| (*line).to_owned()).collect();
    let program = set(&["a v1 [std]", "b v1 []"]);
    assert_none(&against_second_builds(&program, &set(&["a v1 [std]", "c v1 [x]"])));
    assert_eq!(
        against_second_builds(&program, &set(&["a v1 [fs,std]"])),
        ["only the tests ask for: a v1 [fs,std]"]
    );
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

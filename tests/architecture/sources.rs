//! Every file: headers, lengths, no skipped tests, no paths of a machine.

use crate::{
    assert_none, tokens,
    tree::{self, Source},
};

/// Longest Rust file (lines).
const LINE_LIMIT: usize = 400;

fn against_header(source: &Source) -> Option<String> {
    let first = source.text.lines().next().unwrap_or_default();
    let says_something = first.strip_prefix("//!").is_some_and(|text| text.trim().len() > 10);
    (!says_something).then(|| format!("{}: open with `//!` and what enters and leaves", source.path))
}

fn against_length(source: &Source) -> Option<String> {
    let count = source.text.lines().count();
    (count > LINE_LIMIT).then(|| format!("{}: {count} lines, at most {LINE_LIMIT}", source.path))
}

fn against_skipped_tests(source: &Source) -> Option<String> {
    let words = tokens::words(tokens::parse(source));
    words.iter().any(|word| word == "ignore").then(|| format!("{}: holds a skipped test", source.path))
}

/// Folders that every system has, so that naming them names no machine.
const COMMON_FOLDERS: [&str; 8] = ["/", "/tmp/", "/usr/", "/opt/", "/srv/", "/var/", "/src/", "/build/"];

/// Beginnings of paths that exist on one machine only: homes, and where this clone stands.
fn machine_paths() -> Vec<String> {
    let above = tree::root().parent().map(|parent| format!("{}/", parent.display()));
    let homes = ["home", "root", "Users"].map(|name| format!("/{name}/"));
    above.into_iter().chain(homes).filter(|path| !COMMON_FOLDERS.contains(&path.as_str())).collect()
}

fn against_machine_paths(source: &Source, paths: &[String]) -> Vec<String> {
    let starts_path =
        |text: &str, at: usize| !text[..at].ends_with(|c: char| c.is_alphanumeric() || ".-_*~}".contains(c));
    let mut complaints = Vec::new();
    for (index, line) in source.text.lines().enumerate() {
        if paths.iter().any(|path| line.match_indices(path.as_str()).any(|(at, _)| starts_path(line, at))) {
            complaints.push(format!("{}:{}: a path of one machine: {line}", source.path, index + 1));
        }
    }
    complaints
}

#[test]
fn every_rust_file_opens_by_saying_what_enters_and_leaves() {
    assert_none(&tree::rust_sources().iter().filter_map(against_header).collect::<Vec<_>>());
}

#[test]
fn no_rust_file_is_longer_than_the_limit() {
    assert_none(&tree::rust_sources().iter().filter_map(against_length).collect::<Vec<_>>());
}

#[test]
fn no_test_is_skipped() {
    assert_none(&tree::rust_sources().iter().filter_map(against_skipped_tests).collect::<Vec<_>>());
}

#[test]
fn no_file_names_a_path_of_one_machine() {
    let paths = machine_paths();
    let sources = tree::sources(|path| !tree::has_extension(path, "lock"));
    assert_none(&sources.iter().flat_map(|source| against_machine_paths(source, &paths)).collect::<Vec<_>>());
}

#[test]
fn the_rules_find_what_they_are_for() {
    let of = |text: &str| Source::example("x.rs", text);
    assert!(against_header(&of("// Not a header.\n")).is_some());
    assert!(against_header(&of("//!\nfn f() {}")).is_some());
    assert!(against_header(&of("//! Particles to grid: spreads mass.\n")).is_none());
    assert!(against_length(&of(&"\n".repeat(LINE_LIMIT + 1))).is_some());
    assert!(against_length(&of(&"\n".repeat(LINE_LIMIT))).is_none());
    assert!(against_skipped_tests(&of("#[test]\n#[ignore]\nfn f() {}")).is_some());
    let home = format!("let x = \"{}someone/x\";", machine_paths().last().expect("there are some"));
    assert_eq!(against_machine_paths(&of(&home), &machine_paths()).len(), 1);
    assert_none(&against_machine_paths(&of("see ../home/page and a/root/b"), &machine_paths()));
}

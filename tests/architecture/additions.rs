//! The table "Where a thing is added" is counted: its rows say what the patches of `additions/` change.
//!
//! `cargo xtask additions` builds a copy of the program with the patches, so what they leave out, nothing
//! needs.

use std::collections::BTreeSet;

use crate::{
    assert_none,
    tree::{self, Source},
};

/// The page with the table.
const PAGE: &str = "docs/ARCHITECTURE.md";

/// Where the patches are.
const PATCHES: &str = "tests/architecture/additions/";

/// Lines that a patch adds to files that are there already.
#[derive(Debug, Default, PartialEq, Eq)]
struct Lines<'a> {
    files: BTreeSet<&'a str>,
    count: usize,
}

/// What a patch adds to the program, to the tests, and to pages.
fn counted(patch: &str) -> [Lines<'_>; 3] {
    let mut sums = [Lines::default(), Lines::default(), Lines::default()];
    let (mut is_new, mut file) = (false, "");
    for line in patch.lines() {
        if let Some(old) = line.strip_prefix("--- ") {
            is_new = old == "/dev/null";
        } else if let Some(path) = line.strip_prefix("+++ b/") {
            file = path;
        } else if line.starts_with('+') && !is_new {
            let is_test = file.starts_with("tests/") || file.contains("/tests/");
            let is_page = tree::has_extension(file, "md");
            let sum = &mut sums[if is_page { 2 } else { usize::from(is_test) }];
            sum.files.insert(file);
            sum.count += 1;
        }
    }
    sums
}

/// `8 lines in 1 file; tests: 7 in 3; pages: 1 in 1`.
fn told([program, tests, pages]: &[Lines<'_>; 3]) -> String {
    let files = program.files.len();
    let plural = if files == 1 { "" } else { "s" };
    let mut text = format!("{} lines in {files} file{plural}", program.count);
    for (name, lines) in [("tests", tests), ("pages", pages)].into_iter().filter(|(_, l)| l.count > 0) {
        let part = format!("; {name}: {} in {}", lines.count, lines.files.len());
        text.push_str(&part);
    }
    text
}

/// Complaints about the row of the table that a patch proves.
fn against_count(patch: &Source, page: &str) -> Option<String> {
    let name = patch.path.strip_prefix(PATCHES)?.strip_suffix(".patch")?;
    let told = told(&counted(&patch.text));
    let row = page.lines().find(|line| line.starts_with(&format!("| {name} |")));
    let says_so = row.is_some_and(|row| row.contains(&told));
    (!says_so).then(|| format!("{PAGE}: the row of '{name}' says {row:?}; the patch has {told}"))
}

#[test]
fn the_table_of_additions_says_what_the_patches_count() {
    let patches = tree::sources(|path| path.starts_with(PATCHES) && tree::has_extension(path, "patch"));
    assert!(!patches.is_empty(), "{PATCHES} holds patches");
    let page = tree::text(PAGE);
    assert_none(&patches.iter().filter_map(|patch| against_count(patch, &page)).collect::<Vec<_>>());
}

#[test]
fn the_rule_finds_what_it_is_for() {
    let text = "--- /dev/null\n+++ b/a/x.rs\n+one\n--- a/a/mod.rs\n+++ b/a/mod.rs\n-old\n+two\n+three\n\
        --- a/tests/y.rs\n+++ b/tests/y.rs\n+four\n--- a/z.md\n+++ b/z.md\n+five\n";
    let patch = Source::example(&format!("{PATCHES}thing.patch"), text);
    assert_eq!(told(&counted(text)), "2 lines in 1 file; tests: 1 in 1; pages: 1 in 1");
    assert!(
        against_count(&patch, "| thing | `x.rs` | 2 lines in 1 file; tests: 1 in 1; pages: 1 in 1 |")
            .is_none()
    );
    assert!(against_count(&patch, "| thing | `x.rs` | 2 lines in 2 files |").is_some());
    assert!(
        against_count(&patch, "| other | `x.rs` | 2 lines in 1 file; tests: 1 in 1; pages: 1 in 1 |")
            .is_some()
    );
}

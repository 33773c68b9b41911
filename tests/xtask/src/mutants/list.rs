//! What was found: which tests catch which mutant, as a list that is complete and as tables that fit a screen.

use std::collections::BTreeMap;

use super::suite::Suite;

/// The complete list, from the root.
pub(super) const FILE: &str = "docs/laws/mutants.txt";

const HEADER: &str = "\
# Every mutant, and every quick test that catches it.
# Written by `cargo xtask bless mutants`; `cargo xtask mutants` checks the first test of each mutant, and
# `cargo xtask mutants all` the whole list.
";

/// Tests that fail, by the name of the mutant, in the order of their names.
pub(super) type Caught = BTreeMap<String, Vec<String>>;

/// The name of a mutant in the list.
pub(super) fn title(suite: &Suite, mutant: &str) -> String {
    format!("{}: {mutant}", suite.name)
}

/// The list as text.
pub(super) fn render(caught: &Caught) -> String {
    let entry = |(mutant, tests): (&String, &Vec<String>)| {
        let lines: Vec<_> = tests.iter().map(|test| format!("  {test}\n")).collect();
        format!("\n{mutant}\n{}", lines.concat())
    };
    let entries: Vec<_> = caught.iter().map(entry).collect();
    format!("{HEADER}{}", entries.concat())
}

/// The list from its text.
pub(super) fn parse(text: &str) -> Caught {
    let mut caught = Caught::new();
    let mut tests: Option<&mut Vec<String>> = None;
    for line in text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        match (line.strip_prefix("  "), &mut tests) {
            (Some(test), Some(tests)) => tests.push(test.to_owned()),
            _ => tests = Some(caught.entry(line.to_owned()).or_default()),
        }
    }
    caught
}

/// The page of a suite: a row for each mutant.
pub(super) fn page(suite: &Suite, caught: &Caught) -> String {
    let folders: Vec<_> = suite.binaries.iter().map(|binary| format!("`tests/{binary}`")).collect();
    let named = match suite.only {
        [] => String::new(),
        only => format!(" with `{}` in their names", only.join("` or `")),
    };
    let head = format!(
        "# Mutants of {}\n\n\
         A mutant is the program with one error made on purpose. {} of them are built into a copy of the \
         sources, behind a switch\nthat the program itself does not have, and the quick tests of {}{named} are run \
         for each. Without a mutant all of\nthem pass; each mutant makes at least one fail. Long runs are left \
         out. [The complete list](mutants.txt) has every test that\nfails. `cargo xtask mutants` checks this \
         page, `cargo xtask bless mutants` writes it.\n\n\
         | mutant | tests that catch it | the first of them |\n|---|---|---|\n",
        suite.name,
        suite.names.len(),
        folders.join(", "),
    );

    let row = |(_, name): (u32, &str)| {
        let tests = caught.get(&title(suite, name)).map_or(&[][..], Vec::as_slice);
        let first = tests.first().map_or("none", String::as_str);
        format!("| {} | {} | `{first}` |\n", name.replace('|', "\\|"), tests.len())
    };
    let rows: Vec<_> = suite.mutants().map(row).collect();
    head + &rows.concat()
}

#[test]
fn a_list_is_read_as_it_was_written() {
    let tests = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    let caught = Caught::from([
        ("cloth: a".to_owned(), tests(&["cloth::x::y", "linalg::z"])),
        ("snow: b".to_owned(), tests(&[])),
    ]);
    assert_eq!(parse(&render(&caught)), caught);
}

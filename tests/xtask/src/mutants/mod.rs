//! `cargo xtask mutants`: errors made on purpose, and the tests that notice them.
//!
//! Copies the sources into `target/copies/mutants`, builds every mutant into the copy behind a switch, and
//! runs the tests that the list names first for each; each must fail. `cargo xtask mutants cloth` does so for one suite.
//! `cargo xtask mutants all` runs all quick tests for each mutant and compares the whole list, `cargo xtask bless mutants` writes the list and
//! the pages made from it, `cargo xtask bless new-mutants` what they lack. The program itself has no switch.

mod patch;
mod cloth;
mod surface;
mod snow;
mod suite;
mod list;
mod harness;

use std::fs;

use harness::{Harness, Tests};
use list::Caught;
use rayon::prelude::*;
use suite::{SUITES, Suite};

use crate::shell::{Failure, Shell};

/// Checks that every mutant is caught by the test that its page names, or with `all` by all in the list.
///
/// # Errors
/// When a mutant is not caught, or the list or a page is not what was found.
pub(crate) fn run(shell: &mut Shell, arguments: &[String]) -> Result<(), Failure> {
    match arguments {
        [] => shell.step("mutants", |shell| check(shell, &SUITES.each_ref())),
        [all] if all == "all" => shell.step("all mutants", |shell| {
            let caught = search(shell, Caught::new())?;
            files(&caught).into_iter().try_for_each(|(file, text)| compare(shell, file, &text))
        }),
        [name] if SUITES.iter().any(|suite| suite.name == name) => {
            let suites: Vec<_> = SUITES.iter().filter(|suite| suite.name == name).collect();
            shell.step(&format!("mutants of {name}"), |shell| check(shell, &suites))
        }
        _ => Err(Failure("usage: cargo xtask mutants [all | cloth | surfaces | snow]".to_owned())),
    }
}

/// Which mutants a list is written from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Which {
    /// All, whatever the list has.
    All,
    /// Those that the list lacks; the rest of it stays.
    New,
}

/// Writes the list and the pages.
///
/// # Errors
/// When a mutant is not caught.
pub(crate) fn bless(shell: &mut Shell, which: Which) -> Result<(), Failure> {
    shell.step("mutants", |shell| {
        let known = if which == Which::New { read(shell)? } else { Caught::new() };
        let caught = search(shell, known)?;
        for (file, text) in files(&caught) {
            fs::write(shell.root().join(file), text).map_err(|error| Failure(format!("{file}: {error}")))?;
        }
        Ok(())
    })
}

/// Runs the first test of each mutant, as many at a time as there are cores; pages are compared with the list.
fn check(shell: &mut Shell, suites: &[&Suite]) -> Result<(), Failure> {
    let caught = read(shell)?;
    files(&caught).into_iter().try_for_each(|(file, text)| compare(shell, file, &text))?;

    let harness = Harness::build(shell)?;
    for &suite in suites {
        let first_of = |(number, name)| {
            let title = list::title(suite, name);
            let tests =
                caught.get(&title).ok_or_else(|| Failure(format!("{title}: not in {}", list::FILE)))?;
            let first =
                tests.first().ok_or_else(|| Failure(format!("{title}: no test catches it")))?.as_str();
            Ok((number, title, first))
        };
        let mutants: Vec<(u32, String, &str)> = suite.mutants().map(first_of).collect::<Result<_, _>>()?;

        let mut tests: Vec<&str> = mutants.iter().map(|(_, _, first)| *first).collect();
        tests.sort_unstable();
        tests.dedup();
        pass(&harness, suite, Tests::Named(&tests))?;

        mutants.par_iter().try_for_each(|(number, title, first)| {
            let failed = harness.failures(suite, *number, Tests::Named(&[*first]))?;
            if failed.is_empty() {
                return Err(Failure(format!("{title}: {first} does not catch it")));
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// The list as it was written last.
fn read(shell: &Shell) -> Result<Caught, Failure> {
    let text = fs::read_to_string(shell.root().join(list::FILE));
    Ok(list::parse(&text.map_err(|error| Failure(format!("{}: {error}", list::FILE)))?))
}

/// Runs all quick tests for each mutant but the known ones.
fn search(shell: &Shell, mut known: Caught) -> Result<Caught, Failure> {
    let harness = Harness::build(shell)?;
    let (mut caught, mut missed) = (Caught::new(), Vec::new());
    for suite in &SUITES {
        let title = |name: &str| list::title(suite, name);
        let (kept, mutants): (Vec<_>, Vec<_>) =
            suite.mutants().partition(|(_, name)| known.contains_key(&title(name)));
        caught.extend(kept.iter().filter_map(|(_, name)| known.remove_entry(&title(name))));
        if mutants.is_empty() {
            continue;
        }
        pass(&harness, suite, Tests::Quick)?;
        for (number, name) in mutants {
            let tests = harness.failures(suite, number, Tests::Quick)?;
            let title = title(name);
            println!("{:>4} tests fail: {title}", tests.len());
            if tests.is_empty() {
                missed.push(title.clone());
            }
            caught.insert(title, tests);
        }
    }
    if missed.is_empty() {
        Ok(caught)
    } else {
        Err(Failure(format!("no test catches {}", missed.join("; "))))
    }
}

/// Tests that fail without a mutant would catch any.
fn pass(harness: &Harness, suite: &Suite, tests: Tests<'_>) -> Result<(), Failure> {
    let failed = harness.failures(suite, 0, tests)?;
    if failed.is_empty() {
        return Ok(());
    }
    Err(Failure(format!("tests fail without a mutant: {}", failed.join(", "))))
}

/// The list and the pages, by their paths from the root.
fn files(caught: &Caught) -> Vec<(&'static str, String)> {
    let mut files = vec![(list::FILE, list::render(caught))];
    files.extend(SUITES.iter().map(|suite| (suite.page, list::page(suite, caught))));
    files
}

fn compare(shell: &Shell, file: &str, text: &str) -> Result<(), Failure> {
    let there = fs::read_to_string(shell.root().join(file)).unwrap_or_default();
    if there == text {
        return Ok(());
    }
    Err(Failure(format!(
        "{file} is not what was found: run `cargo xtask bless mutants`, and look at the change"
    )))
}

#[test]
fn the_pages_are_those_of_the_list_and_every_mutant_is_in_it() {
    let shell = Shell::at_repository_root();
    let text = fs::read_to_string(shell.root().join(list::FILE)).expect("the list is committed");
    let caught = list::parse(&text);
    for (file, text) in files(&caught) {
        assert!(compare(&shell, file, &text).is_ok(), "{file} is not what the list says");
    }
    let every = |suite: &'static Suite| suite.mutants().map(|(_, name)| list::title(suite, name));
    let titles: std::collections::BTreeSet<_> = SUITES.iter().flat_map(every).collect();
    assert!(titles.iter().eq(caught.keys()), "the list has the mutants of the suites");
    assert!(caught.values().all(|tests| !tests.is_empty()), "each is caught");
}

#[test]
fn every_patch_fits_its_file() {
    let shell = Shell::at_repository_root();
    for suite in &SUITES {
        for patch in suite.patches {
            let file = shell.root().join(suite.folder).join(patch.file);
            let text =
                fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
            assert!(patch.apply(&text).is_ok(), "{}: {:?}", file.display(), patch.apply(&text));
        }
    }
}

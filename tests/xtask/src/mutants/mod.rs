//! `cargo xtask mutants`: mistakes made on purpose, and the tests that notice them.
//!
//! Copies the sources, builds every mistake into the copy behind a switch, runs
//! the quick tests of snow once for each, and writes which of them fail into
//! `docs/laws/snow-mutants.md`, or compares with what is there. The program itself has no switch.

mod patches;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use patches::{Form, NAMES, PATCHES};

use crate::{
    copy::{Copy, cargo_in, replace_once},
    shell::{Failure, Shell},
};

/// The page that the table is written into.
const PAGE: &str = "docs/laws/snow-mutants.md";
/// Tests that are left out: long runs, which say little that the quick ones do not.
const SLOW: [&str; 18] = [
    "manufactured",
    "beam",
    "statics",
    "impact",
    "bounce",
    "bars::",
    "dissipation",
    "semi_implicit",
    "measured_limits",
    "step_bounds",
    "friction",
    "refinement",
    "volumes",
    "a_rigid_body_that_turns",
    "a_body_without_stress_that_turns",
    "affine_transfers_keep_angular_momentum",
    "expected_errors_of_every",
    "the_scene_of_brasseur",
];

/// What the copy's numerics are asked.
const SWITCH: &str = r#"
/// The mistake that is on: 0 for none.
static MISTAKE: std::sync::OnceLock<u32> = std::sync::OnceLock::new();

/// Whether a mistake is on.
pub(crate) fn mutant(number: u32) -> bool {
    let read = || std::env::var("NAPPE_MUTANT").ok().and_then(|n| n.parse().ok()).unwrap_or(0);
    *MISTAKE.get_or_init(read) == number
}
"#;

/// Makes the copy, runs the tests for each mistake, and writes or compares the table.
pub(crate) fn run(shell: &mut Shell, _: &[String]) -> Result<(), Failure> {
    shell.step("mutants", |shell| find(shell, compare))
}

/// The same, but the table is written.
pub(crate) fn bless(shell: &mut Shell) -> Result<(), Failure> {
    shell.step("mutants", |shell| find(shell, write))
}

/// Runs the tests for each mistake and hands the page to `finish`.
fn find(shell: &mut Shell, finish: fn(&Path, &str) -> Result<(), Failure>) -> Result<(), Failure> {
    let mut copy = Copy::of(shell, "mutants")?;
    patch(&mut copy)?;
    let tree = copy.write(shell)?;
    let failures = |mutant| failures(shell, &tree, mutant);
    let none = failures(0)?;
    if !none.is_empty() {
        return Err(Failure(format!("tests fail without a mistake: {}", joined(&none))));
    }
    let mut table = BTreeMap::new();
    for mutant in 1..=NAMES.len() as u32 {
        let caught = failures(mutant)?;
        println!("{mutant:>2} {}: {} tests fail", NAMES[mutant as usize - 1], caught.len());
        table.insert(mutant, caught);
    }
    let missed: Vec<_> =
        table.iter().filter(|(_, caught)| caught.is_empty()).map(|(m, _)| NAMES[*m as usize - 1]).collect();
    finish(&shell.root().join(PAGE), &page(&table))?;
    if missed.is_empty() {
        return Ok(());
    }
    Err(Failure(format!("no test notices: {}", missed.join("; "))))
}

/// Builds the mistakes into the copy.
fn patch(copy: &mut Copy) -> Result<(), Failure> {
    for patch in &PATCHES {
        copy.edit(&format!("server/sim/src/snow/{}", patch.file), |text| apply(text, patch))?;
    }
    copy.edit("server/sim/src/lib.rs", |text| Ok(format!("{text}{SWITCH}")))
}

/// A file's text with a patch.
fn apply(text: &str, patch: &patches::Patch) -> Result<String, String> {
    let (from, to) = (patch.from, patch.to);
    let new = match patch.form {
        Form::Text => to.to_owned(),
        Form::Expression => format!("(if crate::mutant({}) {{ {to} }} else {{ {from} }})", patch.mutant),
    };
    replace_once(text, from, &new).map_err(|reason| format!("mistake {}: {reason}", patch.mutant))
}

/// Tests that fail with a mistake on.
fn failures(shell: &Shell, tree: &Path, mutant: u32) -> Result<BTreeSet<String>, Failure> {
    let mut command = cargo_in(shell, tree);
    command
        .args([
            "test",
            "--release",
            "--locked",
            "-p",
            "nappe-tests",
            "--no-default-features",
            "--test",
            "snow",
        ])
        .arg("--")
        .args(SLOW.iter().flat_map(|slow| ["--skip", slow]))
        .env("NAPPE_MUTANT", mutant.to_string());
    let output = command.output().map_err(|error| Failure(format!("cannot start the tests: {error}")))?;
    let text = String::from_utf8_lossy(&output.stdout);
    if !text.contains("test result:") {
        let errors = String::from_utf8_lossy(&output.stderr);
        return Err(Failure(format!("the copy does not build or run:\n{errors}")));
    }
    let failed = text.lines().filter_map(|line| line.strip_prefix("test ")?.strip_suffix(" ... FAILED"));
    Ok(failed.map(str::to_owned).collect())
}

fn page(table: &BTreeMap<u32, BTreeSet<String>>) -> String {
    let mut page = String::from(
        "# Which test catches which mistake\n\nMade by `cargo xtask bless mutants`: each mistake is built into a copy of the program, and the quick tests of \
         `tests/snow` are run\non it. Without a mistake, all pass. Long runs (bars, beams, columns, impacts, sliding blocks, manufactured solutions) are left out here.\n\n| mistake | tests that fail |\n|---|---|\n",
    );
    let rows =
        table.iter().map(|(m, caught)| format!("| {} | {} |\n", NAMES[*m as usize - 1], joined(caught)));
    page.extend(rows);
    page
}

fn joined(names: &BTreeSet<String>) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

fn write(file: &Path, page: &str) -> Result<(), Failure> {
    fs::write(file, page).map_err(|error| fault(file, &error))
}

fn compare(file: &Path, page: &str) -> Result<(), Failure> {
    let there = fs::read_to_string(file).map_err(|error| fault(file, &error))?;
    if there == page {
        return Ok(());
    }
    Err(Failure(format!("{PAGE} is not what was found: run `cargo xtask bless mutants`\n{page}")))
}

fn fault(file: &Path, error: &std::io::Error) -> Failure {
    Failure(format!("{}: {error}", file.display()))
}

//! `cargo xtask mutants`: mistakes made on purpose, and the tests that notice them.
//!
//! Copies the sources into `target/mutants`, builds every mistake into the copy behind a switch, runs
//! the quick tests of snow once for each, and writes which of them fail into
//! `docs/laws/snow-mutants.md`, or compares with what is there. The program itself has no switch.

mod patches;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
    process::Command,
};

use patches::{Form, NAMES, PATCHES};

use crate::shell::{Failure, Shell, cargo};

/// The page that the table is written into.
const PAGE: &str = "docs/laws/snow-mutants.md";
/// Set, the page is written; else it is compared.
const UPDATE: &str = "UPDATE_DOCS";
/// Tests that are left out: long runs, which say little that the quick ones do not.
const SLOW: [&str; 17] = [
    "manufactured",
    "beam",
    "statics",
    "impact",
    "bounce",
    "bars::",
    "dissipation",
    "semi_implicit",
    "limits",
    "certified",
    "friction",
    "refinement",
    "volumes",
    "affine::a5",
    "conservation::a3",
    "expected_errors_of_every",
    "t4_the_scene",
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
    let tree = shell.target().join("mutants");
    copy(shell, &tree)?;
    let none = failures(&tree, 0)?;
    if !none.is_empty() {
        return Err(Failure(format!("tests fail without a mistake: {}", joined(&none))));
    }
    let mut table = BTreeMap::new();
    for mutant in 1..=NAMES.len() as u32 {
        let caught = failures(&tree, mutant)?;
        println!("{mutant:>2} {}: {} tests fail", NAMES[mutant as usize - 1], caught.len());
        table.insert(mutant, caught);
    }
    let missed: Vec<_> =
        table.iter().filter(|(_, caught)| caught.is_empty()).map(|(m, _)| NAMES[*m as usize - 1]).collect();
    write_or_compare(&shell.root().join(PAGE), &page(&table))?;
    if missed.is_empty() {
        return Ok(());
    }
    Err(Failure(format!("no test notices: {}", missed.join("; "))))
}

/// Copies every file that git does not ignore, with the mistakes built in; what is there already is
/// left alone, so that it need not be built again.
fn copy(shell: &mut Shell, tree: &Path) -> Result<(), Failure> {
    let root = shell.root().to_path_buf();
    let listed = Command::new("git")
        .args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .current_dir(&root)
        .output();
    let listed = listed.map_err(|error| Failure(format!("cannot list files: {error}")))?.stdout;
    let mut patched = 0;
    for name in String::from_utf8_lossy(&listed).split('\0').filter(|name| root.join(name).is_file()) {
        let from = root.join(name);
        let mut content = fs::read(&from).map_err(|error| fault(&from, &error))?;
        let patches = PATCHES.iter().filter(|patch| name == format!("server/sim/src/snow/{}", patch.file));
        for patch in patches {
            let text = String::from_utf8_lossy(&content).into_owned();
            content = apply(&text, patch)?.into_bytes();
            patched += 1;
        }
        if name == "server/sim/src/lib.rs" {
            content.extend_from_slice(SWITCH.as_bytes());
        }
        place(&tree.join(name), &content)?;
    }
    if patched == PATCHES.len() {
        return Ok(());
    }
    Err(Failure(format!("{patched} of {} texts were found: a file was renamed", PATCHES.len())))
}

/// Writes a file unless it is there.
fn place(file: &Path, content: &[u8]) -> Result<(), Failure> {
    if fs::read(file).is_ok_and(|there| there == content) {
        return Ok(());
    }
    let folder = file.parent().expect("a file of the copy is in a folder");
    fs::create_dir_all(folder).map_err(|error| fault(folder, &error))?;
    fs::write(file, content).map_err(|error| fault(file, &error))
}

/// A file's text with a patch.
fn apply(old: &str, patch: &patches::Patch) -> Result<String, Failure> {
    let (from, to) = (patch.from, patch.to);
    let count = old.matches(from).count();
    if count != 1 {
        return Err(Failure(format!(
            "mistake {}: the text stands {count} times in {}, once is needed: {from}",
            patch.mutant, patch.file
        )));
    }
    let new = match patch.form {
        Form::Text => to.to_owned(),
        Form::Expression => format!("(if crate::mutant({}) {{ {to} }} else {{ {from} }})", patch.mutant),
    };
    Ok(old.replacen(from, &new, 1))
}

/// Tests that fail with a mistake on.
fn failures(tree: &Path, mutant: u32) -> Result<BTreeSet<String>, Failure> {
    let mut command = Command::new(cargo());
    command
        .args(["test", "--release", "-p", "nappe-tests", "--no-default-features", "--test", "snow", "--"])
        .args(SLOW.iter().flat_map(|slow| ["--skip", slow]))
        .current_dir(tree)
        // Cargo tells crates of a workspace apart by their path in it: built in the folder of the program,
        // those of the copy would be taken for those of the program.
        .env("CARGO_TARGET_DIR", tree.join("target"))
        .env("NAPPE_MUTANT", mutant.to_string());
    Shell::forget_this_crate(&mut command);
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
        "# Which test catches which mistake\n\nMade by `UPDATE_DOCS=1 cargo xtask mutants`: each mistake is built into a copy of the program, and the quick tests of \
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

fn write_or_compare(file: &Path, page: &str) -> Result<(), Failure> {
    if std::env::var_os(UPDATE).is_some() {
        return fs::write(file, page).map_err(|error| fault(file, &error));
    }
    let there = fs::read_to_string(file).map_err(|error| fault(file, &error))?;
    if there == page {
        return Ok(());
    }
    Err(Failure(format!("{PAGE} is not what was found: run `{UPDATE}=1 cargo xtask mutants`\n{page}")))
}

fn fault(file: &Path, error: &std::io::Error) -> Failure {
    Failure(format!("{}: {error}", file.display()))
}

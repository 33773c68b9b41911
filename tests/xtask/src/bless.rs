//! `cargo xtask bless`: writes every file of the repository that is made from the code.
//!
//! Pages of docs/ that list what the code has, the tree of files, the drawing of the data's way, the committed hashes,
//! the table of mutants, the Rust code of the contract and its image, what TypeScript has of it; by name alone what the
//! parts of `ci` take. Each but the drawing, the reference of Python and the last three is written by the test that compares it, which [`VARIABLE`] turns from a judge into a writer.
//! Look at the change before it is committed: a hash that changed needs a reason in the commit's message.
//!
//! The image is what clients were compiled from: a contract that breaks them is not written over it, unless `contract`
//! is named.

use std::process::Command;

use crate::{
    ci, contract, mutants, picture, python,
    shell::{Failure, Shell, cargo},
    spent, times, typescript,
};

/// The environment variable that makes a test write what it compares.
pub(crate) const VARIABLE: &str = "NAPPE_BLESS";

/// Files that tests write: name of the group, title, and the test in cargo's words.
const WRITERS: [(&str, &str, &str); 9] = [
    // First: whatever else is built is built from it.
    ("pages", "proto/generated", "--test generated"),
    ("pages", "docs/scenes.md", "--test reference -- the_reference_in_the_docs"),
    (
        "pages",
        "docs/errors.md, docs/refusals.md, docs/contract.md, reasons.json and contract.binpb",
        "--test service -- the_page_of",
    ),
    ("pages", "docs/stability.md", "--test stability -- the_page_of_stability"),
    ("pages", "client/cli/tests/golden", "--bin nappe -- files_of_the_same_frames"),
    // After every file that it lists.
    ("pages", "docs/tree.md", "--test architecture -- the_drawn_tree"),
    ("hashes", "tests/golden/hashes.txt", "--test determinism -- every_run_has_its_committed_hash"),
    // After the hashes, of which it is made.
    ("hashes", "server/sim/src/bits.rs", "--test determinism -- the_number_of_the_bits"),
    // After the bits, which it names.
    ("hashes", "tests/golden/session.bin", "--lib -- the_committed_file"),
];

/// Names of all groups.
const GROUPS: [&str; 6] = ["pages", "hashes", "mutants", "new-mutants", "contract", "seconds"];

/// Writes the groups named in `names`, or all.
pub(crate) fn run(shell: &mut Shell, names: &[String]) -> Result<(), Failure> {
    if let Some(unknown) = names.iter().find(|name| !GROUPS.contains(&name.as_str())) {
        return Err(Failure(format!("nothing is called '{unknown}'; there are: {}", GROUPS.join(", "))));
    }
    let asked = |group: &str| names.is_empty() || names.iter().any(|name| name == group);
    for (_, title, test) in WRITERS.into_iter().filter(|(group, ..)| asked(group)) {
        let mut writer = Command::new(cargo());
        writer.args(["test", "--release"]).args(test.split_whitespace()).env(VARIABLE, "1");
        shell.run(title, &mut writer)?;
    }
    if asked("pages") {
        picture::data_flow(shell)?;
        python::bless(shell)?;
        typescript::bless(shell)?;
    }
    if asked("mutants") {
        mutants::bless(shell, mutants::Which::All)?;
    } else if asked("new-mutants") {
        mutants::bless(shell, mutants::Which::New)?;
    }
    if asked("contract") {
        if names.is_empty() { contract::bless(shell)? } else { contract::replace(shell)? }
    }
    // By name alone: after a run of `cargo xtask ci` that was disturbed by nothing.
    if names.iter().any(|name| name == "seconds") {
        shell.step(times::MEASURED, |shell| {
            let mut plan = Shell::for_planning();
            ci::run(&mut plan, &[])?;
            times::write(shell.root(), &shell.target(), &spent::processor(), &plan.titles())
                .map_err(|error| Failure(format!("{} cannot be written: {error}", times::MEASURED)))
        })?;
    }
    shell.run("what changed", Command::new("git").args(["status", "--short"]))
}

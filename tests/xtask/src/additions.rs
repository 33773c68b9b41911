//! `cargo xtask additions`: proves the table "Where a thing is added" of docs/ARCHITECTURE.md.
//!
//! Applies the patches of `tests/architecture/additions` to a copy of the sources, each of which adds
//! one thing, and has the compiler check every crate, test and example of the copy.

use std::fs;

use crate::{
    bless,
    copy::{Copy, cargo_in},
    shell::{Failure, Shell},
};

/// Where the patches are.
const FOLDER: &str = "tests/architecture/additions";

/// Applies the patches one after the other, then checks the copy with all of them.
pub(crate) fn run(shell: &mut Shell, _: &[String]) -> Result<(), Failure> {
    shell.step("additions", build)
}

fn build(shell: &mut Shell) -> Result<(), Failure> {
    let folder = shell.root().join(FOLDER);
    let entries = fs::read_dir(&folder).map_err(|error| Failure(format!("{FOLDER}: {error}")))?;
    let mut patches: Vec<_> = entries.filter_map(Result::ok).map(|entry| entry.path()).collect();
    patches.retain(|path| path.extension().is_some_and(|extension| extension == "patch"));
    patches.sort();
    if patches.is_empty() {
        return Err(Failure(format!("{FOLDER} holds no patch")));
    }
    let mut copy = Copy::of(shell, "additions")?;
    for patch in &patches {
        copy.patch(shell, patch)?;
    }
    let tree = copy.write(shell)?;
    // What is added to the contract is added to its code by the test that compares them.
    let mut generate = cargo_in(shell, &tree);
    generate.args(["test", "--release", "--locked", "--test", "generated"]).env(bless::VARIABLE, "1");
    shell.run("copy: code of the contract", &mut generate)?;
    let mut check = cargo_in(shell, &tree);
    check.args(["check", "--release", "--locked", "--workspace", "--all-targets"]);
    shell.run("copy with additions", &mut check)
}

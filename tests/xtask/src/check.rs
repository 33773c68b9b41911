//! `cargo xtask check`: formatting, lints, documentation, the contract's style and its promise to clients. Changes
//! nothing.
//!
//! The viewer is linted by `cargo xtask prove viewer` alone, and must be as it was then. Lints and documentation use the
//! release profile, so that the build scripts and macros that they need are the ones that the program's build made.

use std::process::Command;

use crate::{
    contract,
    shell::{Failure, Shell, cargo},
    spent,
    times::Times,
    viewer,
};

/// Runs the checks, the quickest first.
pub(crate) fn run(shell: &mut Shell, _: &[String]) -> Result<(), Failure> {
    shell.cargo("format", "fmt --all --check")?;
    contract::check(shell)?;
    viewer::check(shell)?;
    shell.step("seconds of ci", |shell| {
        let measured = Times::measured(shell.root(), &spent::processor());
        Times::read(&shell.target()).growth(&measured).map_or(Ok(()), |growth| Err(Failure(growth)))
    })?;
    match shell.find("typos") {
        Some(typos) => shell.run("spelling", &mut Command::new(typos))?,
        None => shell.skip("spelling", "typos is not installed (PyPI package typos)"),
    }
    shell.cargo("lint", "clippy --release --all-targets --features nappe-tests/slow -- -D warnings")?;
    let mut doc = Command::new(cargo());
    doc.args(["doc", "--release", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings");
    shell.run("documentation", &mut doc)
}

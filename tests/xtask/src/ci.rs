//! `cargo xtask ci`: everything that must hold before a change lands.

use crate::{
    check, python,
    shell::{Failure, Shell},
    test,
};

/// Runs the checks, the tests, a short benchmark and a client in another language.
pub(crate) fn run(shell: &mut Shell, arguments: &[String]) -> Result<(), Failure> {
    check::run(shell, arguments)?;
    test::run(shell, arguments)?;
    shell.cargo("demo", "run --release --package nappe-cli --bin nappe -- bench stream --json")?;
    python::smoke(shell)
}

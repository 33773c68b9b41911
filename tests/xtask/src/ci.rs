//! `cargo xtask ci`: everything that must hold before a change lands.

use crate::{
    check, python,
    shell::{Failure, Shell},
    test, typescript, web,
};

/// Runs the checks and the quick tests.
pub(crate) fn run(shell: &mut Shell, arguments: &[String]) -> Result<(), Failure> {
    check::run(shell, arguments)?;
    test::run(shell, arguments)?;
    typescript::run(shell)?;
    web::page(shell)?;
    python::run(shell, arguments)
}

//! `cargo xtask test`: every test that needs nothing but Rust and a C compiler.
//!
//! The programs and all tests are built once, in the release profile. Only the libraries whose
//! results must have the same bits in every build are built without optimisation too; the viewer's
//! SDK and the service never are.

use crate::shell::{Failure, Shell};

/// Builds, then tests in release, then the libraries again in debug.
pub(crate) fn run(shell: &mut Shell, _: &[String]) -> Result<(), Failure> {
    shell.cargo("build", "build --release --workspace")?;
    shell.cargo("test", "test --release --workspace")?;
    shell.cargo("test, debug", "test -p nappe-sim -p nappe-scene")?;
    shell.cargo("same bits, debug", "test -p nappe-tests --no-default-features --test determinism")
}

//! `cargo xtask test`: every test that needs nothing but Rust and a C compiler.
//!
//! The programs and all tests are built once, in the release profile. `cargo xtask ci` tests the libraries
//! whose results must have the same bits in every build without optimisation too; the viewer's SDK and
//! the service never are.

use std::path::Path;

use crate::shell::{Failure, Shell};

/// The committed hashes without optimisation. That neither threads nor widths of vectors change bits is tested in release:
/// it takes as long again here.
const DEBUG_BITS: &str = "test -p nappe-tests --no-default-features --test determinism -- \
                          --skip any_number_of_threads --skip every_width_of_vector";

/// Builds, then tests in release.
pub(crate) fn run(shell: &mut Shell, _: &[String]) -> Result<(), Failure> {
    // One command: what is left of the programs when cores fall idle is built beside tests.
    shell.cargo("build", "test --release --workspace --no-run")?;
    if shell.find("sshd").is_none() && !Path::new("/usr/sbin/sshd").is_file() {
        shell.skip("nappe connect", "sshd is not installed (Debian package openssh-server)");
    }
    shell.cargo("tests", "test --release --workspace")
}

/// Tests the libraries in debug.
pub(crate) fn debug(shell: &mut Shell) -> Result<(), Failure> {
    shell.cargo("libraries in debug", "test -p nappe-sim -p nappe-scene")?;
    shell.cargo("same bits in debug", DEBUG_BITS)
}

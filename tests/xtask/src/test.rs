//! `cargo xtask test [--viewer]`: every quick test, with nothing but Rust and a C compiler; ranks where MPI is installed.
//!
//! The programs and all tests are built once, in the release profile. What takes long is proven by `cargo xtask prove`. The
//! viewer's tests need its SDK, 150 crates: they are left out while nothing that they depend on has changed.

use std::{path::Path, process::Command};

use crate::{
    ranks,
    shell::{Failure, Shell, cargo},
    suites, viewer,
};

/// What cargo builds and tests: the workspace but for the viewer, so that the program and its tests share one build.
const ALL: &str = "--release";

/// Builds, then tests.
pub(crate) fn run(shell: &mut Shell, arguments: &[String]) -> Result<(), Failure> {
    let with_viewer = match arguments {
        [] => !viewer::is_proven(shell)?,
        [word] if word == "--viewer" => true,
        words => {
            return Err(Failure(format!("'{}': test takes --viewer, and nothing else", words.join(" "))));
        }
    };
    // Rules about dependencies read the viewer's too, which no build here downloads.
    shell.cargo("fetch", "fetch --locked --quiet")?;
    // One command: what is left of the programs when cores fall idle is built beside tests.
    shell.cargo("build", &format!("test {ALL} --no-run"))?;
    if shell.find("sshd").is_none() && !Path::new("/usr/sbin/sshd").is_file() {
        shell.skip("nappe connect", "sshd is not installed (Debian package openssh-server)");
    }
    ranks::build(shell)?;
    suites::run(shell, "tests", ALL, &[], suites::QUICK)?;
    ranks::test(shell)?;
    let mut documents = Command::new(cargo());
    documents.args(["test", "--doc"]).args(ALL.split_whitespace());
    shell.watched("code in documents", &mut documents, suites::QUICK)?;
    if with_viewer { viewer::test(shell) } else { Ok(()) }
}

//! The contract's style, and whether it still understands clients that were compiled before.
//!
//! Reads `proto/` and its committed image, from which a client may have been compiled. Both need buf.

use std::{path::PathBuf, process::Command};

use crate::shell::{Failure, Shell};

/// The contract as it was when it was blessed.
const IMAGE: &str = "proto/image.binpb";

/// Style, and no change that breaks clients of the image.
pub(crate) fn check(shell: &mut Shell) -> Result<(), Failure> {
    let Some(buf) = found(shell, "contract") else { return Ok(()) };
    shell.run("contract", Command::new(&buf).args(["lint", "proto"]))?;
    breaking(shell, &buf)
}

/// Writes the image of a contract that breaks no client of the one before.
pub(crate) fn bless(shell: &mut Shell) -> Result<(), Failure> {
    if let Some(buf) = found(shell, IMAGE) {
        breaking(shell, &buf)?;
        replace(shell)?;
    }
    Ok(())
}

/// Writes the image, whatever it breaks.
pub(crate) fn replace(shell: &mut Shell) -> Result<(), Failure> {
    let Some(buf) = found(shell, IMAGE) else { return Ok(()) };
    shell.run(IMAGE, Command::new(buf).args(["build", "proto", "--exclude-source-info", "-o", IMAGE]))
}

fn breaking(shell: &mut Shell, buf: &PathBuf) -> Result<(), Failure> {
    shell.run("contract before", Command::new(buf).args(["breaking", "proto", "--against", IMAGE]))
}

fn found(shell: &mut Shell, title: &str) -> Option<PathBuf> {
    let buf = shell.find("buf");
    if buf.is_none() {
        shell.skip(title, "buf is not installed (npm package @bufbuild/buf)");
    }
    buf
}

//! `cargo xtask tarball`: the programs in one archive, with the README and the licences.

use std::{
    env::consts::ARCH,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::shell::{Failure, Shell};

use super::{
    notices,
    programs::{self, Glibc, Programs, VERSION, failure, make_anew},
};

/// What the name of an archive ends in.
pub(super) const ENDING: &str = ".tar.gz";

/// Makes it, and says where it is.
pub(crate) fn run(shell: &mut Shell, _: &[String]) -> Result<(), Failure> {
    programs::build(shell)?;
    shell.step("tarball", |shell| {
        println!("{}", made(shell)?.display());
        Ok(())
    })
}

/// What the archive of programs that need such a C library is called, without its ending; so is the folder in it.
pub(super) fn name(needs: Glibc) -> String {
    format!("nappe-{VERSION}-linux-{ARCH}-glibc-{needs}")
}

/// The archive, made from what was built.
///
/// # Errors
/// When a file cannot be read or written, or a program needs what not every system has.
pub(super) fn made(shell: &mut Shell) -> Result<PathBuf, Failure> {
    let programs = Programs::stripped(shell)?;
    let (name, dist) = (name(programs.needs), programs::dist(shell));
    let folder = dist.join(&name);
    make_anew(&folder)?;
    let bin = folder.join("bin");
    make_anew(&bin)?;
    programs.files.iter().try_for_each(|file| copy(file, &bin))?;
    copy(&shell.root().join("README.md"), &folder)?;
    notices::files(shell, &programs.folder)?.iter().try_for_each(|file| copy(file, &folder))?;

    let archive = dist.join(format!("{name}{ENDING}"));
    let mut tar = Command::new("tar");
    tar.current_dir(&dist).args(["--create", "--gzip", "--sort=name", "--owner=0", "--group=0"]);
    shell.run("tarball: archive", tar.args(["--numeric-owner", "--file"]).arg(&archive).arg(&name))?;
    fs::remove_dir_all(&folder).map_err(|error| failure(&folder, &error))?;
    Ok(archive)
}

/// Copies a file into a folder; a program stays one.
fn copy(file: &Path, folder: &Path) -> Result<(), Failure> {
    let to = folder.join(file.file_name().unwrap_or_default());
    fs::copy(file, to).map_err(|error| failure(file, &error))?;
    Ok(())
}

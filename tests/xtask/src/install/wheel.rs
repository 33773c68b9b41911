//! `cargo xtask wheel`: the package for Python and the programs in one file that pip installs.
//!
//! The package's backend makes its wheel, `client/python/tools/wheel.py` adds the programs; the tag says the oldest C
//! library that has every symbol that they ask for.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::shell::{Failure, Shell};

use super::{
    notices,
    programs::{self, Glibc, Programs, VERSION, failure},
};

/// Where the package is.
const PACKAGE: &str = "./client/python";

/// What adds programs to its wheel.
const TOOL: &str = "client/python/tools/wheel.py";

/// How pip builds the package with the backend that is installed, and with one that it fetches.
const INSTALLED: &[&str] = &["--no-build-isolation", "--no-index"];
const FETCHED: &[&str] = &[];

/// Largest wheel (bytes).
const LIMIT: u64 = 30_000_000;

/// Makes it, and says where it is.
pub(crate) fn run(shell: &mut Shell, _: &[String]) -> Result<(), Failure> {
    programs::build(shell)?;
    shell.step("wheel", |shell| {
        println!("pip install {}", made(shell)?.display());
        Ok(())
    })
}

/// What the wheel with programs that need such a C library is called.
pub(super) fn name(needs: Glibc) -> String {
    format!("nappe-{VERSION}-py3-none-{}.whl", needs.platform())
}

/// The wheel, made from what was built.
///
/// # Errors
/// When pip is not there, a program needs what not every system has, or the wheel is too large.
pub(super) fn made(shell: &mut Shell) -> Result<PathBuf, Failure> {
    let programs = Programs::stripped(shell)?;
    let licences = notices::files(shell, &programs.folder)?;
    let (python, how) = backend(shell)?;
    let package = package(shell, &python, how, &programs.folder)?;
    let dist = programs::dist(shell);
    let mut add = Command::new(&python);
    add.arg(TOOL).arg("--wheel").arg(&package).arg("--into").arg(&dist);
    add.args(["--platform", &programs.needs.platform()]);
    add.arg("--program").args(&programs.files).arg("--licence").args(&licences);
    shell.run("wheel: programs", &mut add)?;

    let wheel = dist.join(name(programs.needs));
    let size = fs::metadata(&wheel).map_err(|error| failure(&wheel, &error))?.len();
    if size > LIMIT {
        return Err(failure(&wheel, &format!("it has {size} bytes, {LIMIT} are allowed")));
    }
    Ok(wheel)
}

/// A Python with pip, and how that builds the package.
fn backend(shell: &Shell) -> Result<(PathBuf, &'static [&'static str]), Failure> {
    if let Some(python) = shell.python_with("hatchling, pip") {
        return Ok((python, INSTALLED));
    }
    let python = shell.python_with("pip");
    let missing = || Failure("Python with pip is not installed (Debian package python3-pip)".to_owned());
    Ok((python.ok_or_else(missing)?, FETCHED))
}

/// The wheel of the package alone, in `folder`.
fn package(shell: &mut Shell, python: &Path, how: &[&str], folder: &Path) -> Result<PathBuf, Failure> {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps"]).args(how);
    shell.run("wheel: package", pip.arg("--wheel-dir").arg(folder).arg(PACKAGE))?;
    Ok(folder.join(format!("nappe-{VERSION}-py3-none-any.whl")))
}

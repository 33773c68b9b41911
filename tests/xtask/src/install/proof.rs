//! The proof of wheel and tarball: both are installed and used where nothing of the repository is.
//!
//! A part of `cargo xtask prove builds`. What is used knows neither the environment of this task nor a folder of it. The libraries that the package needs come
//! from the project's own environment, so that no network is asked.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::shell::{Failure, Shell};

use super::{
    programs::{self, NAMES, VERSION, failure, make_anew, needed},
    tarball, wheel,
};

/// Where programs of the system are, and nothing else.
const SYSTEM: &str = "/usr/bin:/bin";

/// What a run is saved as: a page, and a recording, for which the command starts the viewer.
const SAVED: [&str; 2] = ["flag.html", "flag.rrd"];

/// Prints the folder that the libraries of a Python are in.
const LIBRARIES: &str = "import numpy, pathlib; print(pathlib.Path(numpy.__file__).parents[1])";

/// Lets another Python find them, behind what is installed there.
const FOUND: &str = "\
import pathlib, sys, sysconfig
pathlib.Path(sysconfig.get_path('purelib'), 'libraries.pth').write_text(sys.argv[1] + '\\n')
";

/// Uses the package, with the server that came with it.
const SESSION: &str = "\
import os, sys
import nappe
from nappe._server._launch import program

assert nappe.__file__.startswith(sys.prefix), nappe.__file__
assert os.path.samefile(program(), os.path.join(sys.prefix, 'bin', 'nappe-server')), program()
with nappe.serve() as server, server.create('flag', step_limit=20) as session:
    assert len(session.trajectory().positions) > 1
";

/// Installs both, and uses what they bring.
pub(crate) fn prove(shell: &mut Shell) -> Result<(), Failure> {
    programs::build(shell)?;
    shell.step("tarball and wheel: installed", |shell| {
        let place = Place(shell.target().join(format!("installed-{}", std::process::id())));
        make_anew(&place.0)?;
        let archive = tarball::made(shell)?;
        place.unpacked(shell, &archive)?;
        let Some(python) = shell.python_with("google.rpc, grpc, hatchling, numpy, pip") else {
            shell.skip("wheel: installed", "what the package needs is not installed: .ci/run does");
            return Ok(());
        };
        let wheel = wheel::made(shell)?;
        place.installed(shell, &python, &wheel)
    })
}

/// A folder of this proof alone, which goes when it has ended.
struct Place(PathBuf);

impl Place {
    /// Unpacks an archive, and uses its programs.
    fn unpacked(&self, shell: &mut Shell, archive: &Path) -> Result<(), Failure> {
        let mut tar = Command::new("tar");
        tar.arg("--extract").arg("--file").arg(archive).arg("--directory").arg(&self.0);
        shell.run("tarball: unpack", &mut tar)?;
        let file = file_name(archive);
        let folder = self.0.join(file.trim_end_matches(tarball::ENDING));
        for name in ["README.md", "LICENSE", "LICENSE-APACHE", "LICENSE-MIT", "LICENSES-OF-CRATES.txt"] {
            filled(&folder.join(name))?;
        }
        let bin = folder.join("bin");
        let needs = needed(shell, &NAMES.map(|name| bin.join(name)))?;
        let name = format!("{}{}", tarball::name(needs), tarball::ENDING);
        if file != name {
            return Err(failure(archive, &format!("by what its programs need it is {name}")));
        }
        self.works(shell, &bin)
    }

    /// Installs a wheel into a new environment, and uses its programs and the package.
    fn installed(&self, shell: &mut Shell, python: &Path, wheel: &Path) -> Result<(), Failure> {
        let folder = self.0.join("venv");
        let bin = folder.join("bin");
        shell.run("wheel: environment", Command::new(python).args(["-m", "venv"]).arg(&folder))?;
        let mut pip = self.clean(&bin.join("python"));
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
        shell.run("wheel: install", pip.args(["--no-deps", "--no-index"]).arg(wheel))?;
        let libraries = shell.printed(Command::new(python).args(["-c", LIBRARIES]))?;
        shell.printed(self.clean(&bin.join("python")).args(["-c", FOUND, libraries.trim()]))?;

        let needs = needed(shell, &NAMES.map(|name| bin.join(name)))?;
        let name = wheel::name(needs);
        if file_name(wheel) != name {
            return Err(failure(wheel, &format!("by what its programs need it is {name}")));
        }
        self.works(shell, &bin)?;
        shell.run("wheel: a session", self.clean(&bin.join("python")).args(["-c", SESSION]))
    }

    /// Asks the programs in a folder for their version, and has the command save a run in each way.
    fn works(&self, shell: &Shell, bin: &Path) -> Result<(), Failure> {
        for name in NAMES {
            let told = shell.printed(self.clean(&bin.join(name)).arg("--version"))?;
            if !told.starts_with(&format!("{name} {VERSION}")) {
                return Err(failure(&bin.join(name), &format!("as its version it tells {told}")));
            }
        }
        for file in SAVED {
            let saved = self.0.join(file);
            let mut run = self.clean(&bin.join("nappe"));
            shell.printed(run.args(["run", "flag", "--steps", "20", "--save", file]))?;
            filled(&saved)?;
            fs::remove_file(&saved).map_err(|error| failure(&saved, &error))?;
        }
        Ok(())
    }

    /// A program that finds programs of the system alone, and none of this task's settings.
    fn clean(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        command.env_clear().env("PATH", SYSTEM).env("HOME", &self.0).current_dir(&self.0);
        command
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        // What is left of a proof that failed is in nobody's way.
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Fails where a file is not there, or has nothing in it.
fn filled(file: &Path) -> Result<(), Failure> {
    let size = fs::metadata(file).map_err(|error| failure(file, &error))?.len();
    if size > 0 { Ok(()) } else { Err(failure(file, &"it is empty")) }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

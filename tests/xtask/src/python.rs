//! `cargo xtask python`: the package for Python, installed and tested against the server that was built.
//!
//! Two environments under `target/tools`, which `.ci/run` makes: one with the newest versions of the libraries, and one
//! with the oldest that the package declares. Types and style, and what pandas and Gymnasium make of the package, are
//! checked in the first.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    shell::{Failure, Shell},
    suites, web,
};

/// Where the package is.
const FOLDER: &str = "client/python";
/// What the environments have: for tests in both, for checks and some tests in the first.
const TESTED: &str = "google.rpc, grpc, hatchling, numpy, pytest, pytest_asyncio";
const CHECKED: &str = "gymnasium, mypy, pandas, ruff";
/// What reads saved files back: a title, its environment, and the tests.
const READERS: [(&str, &str, &[&str]); 3] = [
    (
        "files in VTK, usd-core, h5py and pandas",
        "python-readers",
        &["tests/test_vtk.py", "tests/test_usd.py", "tests/test_tables.py"],
    ),
    ("files in the oldest usd-core", "python-readers-oldest", &["tests/test_usd.py"]),
    ("files in Blender", "python-blender", &["tests/test_blender.py"]),
];

/// Checks and tests the package as far as Python and its libraries are there.
pub(crate) fn run(shell: &mut Shell, _: &[String]) -> Result<(), Failure> {
    shell.step("python: server", |shell| match server(shell) {
        program if program.is_file() => Ok(()),
        program => Err(Failure(format!("{} is not built: cargo xtask test builds it", program.display()))),
    })?;
    match shell.python_with(&format!("{TESTED}, {CHECKED}")) {
        Some(python) => shell.step("python", |shell| newest(shell, &python))?,
        None => shell.skip("python", "what the package needs is not installed: .ci/run does"),
    }
    let oldest = shell.target().join("tools/python-oldest/bin/python3");
    if !oldest.is_file() {
        shell.skip("python: oldest versions", "no Python from 3.10 to 3.12 has them: .ci/run looks for one");
        return Ok(());
    }
    shell.step("python: oldest versions", |shell| {
        install(shell, &oldest)?;
        let mut tests = pytest(shell, &oldest);
        shell.watched(
            "python: tests with the oldest",
            tests.arg("--ignore=tests/test_documents.py"),
            suites::QUICK,
        )
    })
}

fn newest(shell: &mut Shell, python: &Path) -> Result<(), Failure> {
    for (title, words) in [
        ("python: style", &["ruff", "check"][..]),
        ("python: format", &["ruff", "format", "--check"]),
        ("python: types", &["mypy"]),
    ] {
        shell.run(title, module(shell, python, words[0]).args(&words[1..]))?;
    }
    match shell.find("pyright") {
        Some(pyright) => {
            let mut types = Command::new(pyright);
            types.current_dir(shell.root().join(FOLDER)).arg("--pythonpath").arg(python);
            shell.run("python: types again", &mut types)?;
        }
        None => shell.skip("python: types again", "pyright is not installed (npm package pyright)"),
    }
    install(shell, python)?;
    shell.run("python: reference", &mut reference(python, "--check"))?;
    let mut tests = pytest(shell, python);
    shell.watched("python: tests", &mut tests, suites::QUICK)?;
    recording(shell, python)
}

/// Writes the reference of docs/python.md, for which any Python will do.
pub(crate) fn bless(shell: &mut Shell) -> Result<(), Failure> {
    let Some(python) = shell.find("python3") else {
        shell.skip("docs/python.md", "Python is not installed");
        return Ok(());
    };
    shell.run("docs/python.md", &mut reference(&python, "--write"))
}

/// What programs of others read in the files that the command and the package have saved, where these are there.
pub(crate) fn read_back(shell: &mut Shell) -> Result<(), Failure> {
    for (title, folder, tests) in READERS {
        let python = shell.target().join("tools").join(folder).join("bin/python3");
        if !python.is_file() {
            shell.skip(title, "they are not installed: .ci/run prove does");
            continue;
        }
        shell.step(title, |shell| {
            install(shell, &python)?;
            let mut read = pytest(shell, &python);
            shell.watched(&format!("{title}: tests"), read.args(tests), suites::SLOW)
        })?;
    }
    Ok(())
}

/// Throughput and latency of the package on the server that was built, where its libraries are there.
pub(crate) fn measure(shell: &mut Shell) -> Result<(), Failure> {
    let title = "python: measure";
    let Some(python) = shell.python_with("google.rpc, grpc, numpy") else {
        shell.skip(title, "what the package needs is not installed: .ci/run does");
        return Ok(());
    };
    let mut measure = Command::new(python);
    measure.arg(format!("{FOLDER}/tools/measure.py")).env("NAPPE_SERVER_PROGRAM", server(shell));
    shell.run(title, measure.env("PYTHONPATH", shell.root().join(FOLDER).join("src")))
}

/// Compares the reference of docs/python.md with the docstrings, or writes it.
fn reference(python: &Path, what: &str) -> Command {
    let mut command = Command::new(python);
    command.arg(format!("{FOLDER}/tools/reference.py")).arg(what);
    command
}

/// A module of an environment, run in the folder of the package.
fn module(shell: &Shell, python: &Path, name: &str) -> Command {
    let mut command = Command::new(python);
    command.current_dir(shell.root().join(FOLDER)).args(["-m", name]);
    command
}

/// Builds the package and installs it, as a user does, without the network: tests read what a wheel holds.
fn install(shell: &mut Shell, python: &Path) -> Result<(), Failure> {
    let mut pip = module(shell, python, "pip");
    pip.args(["install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index", "--force-reinstall"]);
    shell.run("python: install", pip.args(["--disable-pip-version-check", "."]))
}

/// Tests of the package that is installed, on the server that was built.
fn pytest(shell: &Shell, python: &Path) -> Command {
    let mut tests = module(shell, python, "pytest");
    tests.args(["-v", "-p", "no:cacheprovider"]).env("NAPPE_SERVER_PROGRAM", server(shell));
    tests.env("CARGO_TARGET_DIR", shell.target()).env("PYTHONUNBUFFERED", "1");
    tests
}

fn server(shell: &Shell) -> PathBuf {
    shell.target().join("release/nappe-server")
}

/// A page that Python saved, opened in the browser that opens those of the command.
fn recording(shell: &mut Shell, python: &Path) -> Result<(), Failure> {
    let folder = shell.target().join("page");
    fs::create_dir_all(&folder)
        .map_err(|error| Failure(format!("{} cannot be made: {error}", folder.display())))?;
    let file = folder.join("python.html");
    let mut export = Command::new(python);
    export.args(["-m", "nappe.examples.export", "--scene", "demo", "--steps", "400", "--out"]).arg(&file);
    shell.run("python: save a page", export.env("NAPPE_SERVER_PROGRAM", server(shell)))?;
    web::show(shell, "python: show the page", &file)
}

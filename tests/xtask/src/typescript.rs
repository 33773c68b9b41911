//! The client for TypeScript: its types, whether its generated code is what the contract makes, and its tests on the
//! server that was built.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
    process::Command,
};

use crate::shell::{Failure, Shell};

/// Where the package is.
const FOLDER: &str = "client/typescript";
/// What is made from the contract.
const GENERATED: &str = "client/typescript/src/gen";

/// Checks and tests the package, as far as Node and its packages are there.
pub(crate) fn run(shell: &mut Shell) -> Result<(), Failure> {
    let Some(npm) = npm(shell, "typescript") else { return Ok(()) };
    shell.step("typescript", |shell| {
        shell.run("typescript: check", &mut script(&npm, "check"))?;
        generated(shell, &npm)?;
        let mut tests = script(&npm, "test");
        on_server(shell, &mut tests);
        shell.run("typescript: test", &mut tests)
    })
}

/// Makes the generated code, where what makes it is there.
pub(crate) fn bless(shell: &mut Shell) -> Result<(), Failure> {
    let Some(npm) = npm(shell, GENERATED) else { return Ok(()) };
    shell.run(GENERATED, &mut script(&npm, "gen"))
}

/// Throughput of the package on the server that was built, and how soon streams that are left are gone.
pub(crate) fn measure(shell: &mut Shell) -> Result<(), Failure> {
    let Some(npm) = npm(shell, "typescript: measure") else { return Ok(()) };
    let mut measure = script(&npm, "measure");
    on_server(shell, &mut measure);
    shell.run("typescript: measure", &mut measure)
}

/// Thirty pupils of this package in a class that the built command holds.
pub(crate) fn class(shell: &mut Shell) -> Result<(), Failure> {
    let Some(npm) = npm(shell, "class") else { return Ok(()) };
    let mut class = script(&npm, "class");
    class.env("NAPPE_PROGRAM", shell.target().join("release/nappe"));
    shell.run("class", &mut class)
}

/// The program that runs scripts of the package, if all that they need is there.
fn npm(shell: &mut Shell, title: &str) -> Option<PathBuf> {
    let (Some(_), Some(npm)) = (shell.find("node"), shell.find("npm")) else {
        shell.skip(title, "Node is not installed (Debian package npm)");
        return None;
    };
    if !shell.root().join(FOLDER).join("node_modules").is_dir() {
        shell.skip(title, "its packages are not installed: npm ci --prefix client/typescript");
        return None;
    }
    Some(npm)
}

fn script(npm: &Path, name: &str) -> Command {
    let mut command = Command::new(npm);
    command.args(["--prefix", FOLDER, "run", "--silent", name]);
    command
}

/// Tells a script where the server and the examples are that were built.
fn on_server(shell: &Shell, script: &mut Command) {
    let target = shell.target();
    script.env("NAPPE_SERVER_PROGRAM", target.join("release/nappe-server")).env("CARGO_TARGET_DIR", target);
}

/// Makes the generated code again: the committed files must come out.
fn generated(shell: &mut Shell, npm: &Path) -> Result<(), Failure> {
    let folder = shell.root().join(GENERATED);
    let committed = files(&folder)?;
    shell.run("typescript: gen", &mut script(npm, "gen"))?;
    if files(&folder)? == committed {
        return Ok(());
    }
    Err(Failure(format!(
        "{GENERATED} is not what the contract makes; it is now: look at the change and commit it"
    )))
}

/// All files of a folder and below it, with their bytes.
fn files(folder: &Path) -> Result<BTreeMap<PathBuf, Vec<u8>>, Failure> {
    let failure = |error: io::Error| Failure(format!("{} cannot be read: {error}", folder.display()));
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).map_err(failure)? {
        let path = entry.map_err(failure)?.path();
        if path.is_dir() {
            found.extend(files(&path)?);
        } else {
            let bytes = fs::read(&path).map_err(failure)?;
            found.insert(path, bytes);
        }
    }
    Ok(found)
}

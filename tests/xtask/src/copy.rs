//! A copy of the sources that is changed and built: enters what git tracks or would track, leaves a
//! folder under `target/` that cargo builds beside the program.
//!
//! The copy is built in the program's own target folder, so that every crate of a registry is there already.
//! Cargo tells crates apart by name, version and place in the workspace; the copy's version differs, so
//! that its crates are never taken for the program's.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::shell::{Failure, Shell, cargo};

/// The workspace's manifest, which holds the version of its crates.
const MANIFEST: &str = "Cargo.toml";
/// The lock file, which repeats it.
const LOCK: &str = "Cargo.lock";

/// Whether kernels are compiled for 512 bits: the line that says so, and the one that says no.
const WIDE: [&str; 2] = ["\nconst WIDE: bool = true;\n", "\nconst WIDE: bool = false;\n"];
/// Where it stands.
const LEVELS: &str = "server/sim/src/math/simd/mod.rs";

/// The sources of the program, changed or not.
pub(crate) struct Copy {
    /// Names the folder of the copy and ends its version.
    name: &'static str,
    /// Contents by path from the root, with `/`.
    files: BTreeMap<String, Vec<u8>>,
}

impl Copy {
    /// Reads every file that git does not ignore.
    pub(crate) fn of(shell: &Shell, name: &'static str) -> Result<Self, Failure> {
        let mut git = Command::new("git");
        git.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]).current_dir(shell.root());
        let listed = git.output().map_err(|error| Failure(format!("git cannot list files: {error}")))?;
        if !listed.status.success() {
            return Err(Failure(String::from_utf8_lossy(&listed.stderr).into_owned()));
        }
        let mut copy = Self { name, files: BTreeMap::new() };
        for path in String::from_utf8_lossy(&listed.stdout).split('\0') {
            let file = shell.root().join(path);
            if file.is_file() {
                copy.files.insert(path.to_owned(), fs::read(&file).map_err(|error| of_file(&file, &error))?);
            }
        }
        let version = format!("{}-{name}", env!("CARGO_PKG_VERSION"));
        copy.edit(MANIFEST, |text| with_version(text, &version))?;
        copy.edit(LOCK, |text| with_locked_version(text, &version))?;
        Ok(copy)
    }

    /// Changes the text of one file.
    ///
    /// # Errors
    /// When it is not there, and what `change` complains of.
    pub(crate) fn edit(
        &mut self,
        path: &str,
        change: impl FnOnce(&str) -> Result<String, String>,
    ) -> Result<(), Failure> {
        let content = self.files.get_mut(path).ok_or_else(|| Failure(format!("{path} is not there")))?;
        let text = String::from_utf8_lossy(content).into_owned();
        *content = change(&text).map_err(|reason| Failure(format!("{path}: {reason}")))?.into_bytes();
        Ok(())
    }

    /// Leaves the kernels for one set of instructions only, so that the copy builds sooner: results have the
    /// same bits with every set.
    ///
    /// # Errors
    /// When the line that chooses is not where it was.
    pub(crate) fn with_one_instruction_set(&mut self) -> Result<(), Failure> {
        let [wide, narrow] = WIDE;
        self.edit(LEVELS, |text| replace_once(text, wide, narrow))
    }

    /// Applies a patch in the format of `git diff`.
    ///
    /// # Errors
    /// When git does not accept it: the lines around a change are others by now.
    pub(crate) fn patch(&mut self, shell: &Shell, patch: &Path) -> Result<(), Failure> {
        let text = fs::read_to_string(patch).map_err(|error| of_file(patch, &error))?;
        let scratch = folder(shell, "patched");
        let _ = fs::remove_dir_all(&scratch);
        let touched: Vec<_> = text.lines().filter_map(|line| line.strip_prefix("+++ b/")).collect();
        for path in &touched {
            if let Some(content) = self.files.get(*path) {
                place(&scratch.join(path), content)?;
            }
        }
        fs::create_dir_all(&scratch).map_err(|error| of_file(&scratch, &error))?;
        let mut git = Command::new("git");
        git.arg("apply").arg(patch).current_dir(&scratch);
        // The scratch folder lies inside the repository, whose paths are not those of the patch.
        let output = git.env("GIT_CEILING_DIRECTORIES", shell.target()).output();
        let output = output.map_err(|error| Failure(format!("git cannot be started: {error}")))?;
        if !output.status.success() {
            let reason = String::from_utf8_lossy(&output.stderr);
            return Err(Failure(format!("{} does not apply any more:\n{reason}", patch.display())));
        }
        for path in touched {
            let file = scratch.join(path);
            let content = fs::read(&file).map_err(|error| of_file(&file, &error))?;
            self.files.insert(path.to_owned(), content);
        }
        Ok(())
    }

    /// Writes the copy into its folder and returns that. A file that is there already is left alone, so
    /// that it need not be built again; one that does not belong to the copy is removed.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub(crate) fn write(&self, shell: &Shell) -> Result<PathBuf, Failure> {
        let tree = folder(shell, self.name);
        for (path, content) in &self.files {
            place(&tree.join(path), content)?;
        }
        self.remove_others(&tree, &tree)?;
        Ok(tree)
    }

    fn remove_others(&self, tree: &Path, within: &Path) -> Result<(), Failure> {
        let entries = fs::read_dir(within).map_err(|error| of_file(within, &error))?;
        for entry in entries.filter_map(Result::ok) {
            let path = entry.path();
            if path.is_dir() {
                self.remove_others(tree, &path)?;
                continue;
            }
            let name = path.strip_prefix(tree).expect("an entry of the copy lies in it");
            let name = name.to_string_lossy().replace('\\', "/");
            if !self.files.contains_key(&name) {
                fs::remove_file(&path).map_err(|error| of_file(&path, &error))?;
            }
        }
        Ok(())
    }
}

/// Cargo in the folder of a copy, with the program's target folder.
pub(crate) fn cargo_in(shell: &Shell, tree: &Path) -> Command {
    let mut command = Command::new(cargo());
    command.current_dir(tree).env("CARGO_TARGET_DIR", shell.target());
    Shell::forget_this_crate(&mut command);
    command
}

/// Where the copy of this name stands.
fn folder(shell: &Shell, name: &str) -> PathBuf {
    shell.target().join("copies").join(name)
}

/// Writes a file unless it is there.
fn place(file: &Path, content: &[u8]) -> Result<(), Failure> {
    if fs::read(file).is_ok_and(|there| there == content) {
        return Ok(());
    }
    let folder = file.parent().expect("a file of the copy is in a folder");
    fs::create_dir_all(folder).map_err(|error| of_file(folder, &error))?;
    fs::write(file, content).map_err(|error| of_file(file, &error))
}

/// The manifest of the workspace with another version of its crates.
fn with_version(manifest: &str, version: &str) -> Result<String, String> {
    replace_once(
        manifest,
        &format!("\nversion = \"{}\"\n", env!("CARGO_PKG_VERSION")),
        &format!("\nversion = \"{version}\"\n"),
    )
}

/// The lock file with another version of the crates that come from no registry.
fn with_locked_version(lock: &str, version: &str) -> Result<String, String> {
    let old = format!("version = \"{}\"", env!("CARGO_PKG_VERSION"));
    let mut packages: Vec<_> = lock.split("\n[[package]]\n").map(str::to_owned).collect();
    let mut count = 0;
    for package in packages.iter_mut().skip(1).filter(|package| !package.contains("\nsource = ")) {
        *package = replace_once(package, &old, &format!("version = \"{version}\""))?;
        count += 1;
    }
    if count == 0 {
        return Err("it names no crate of the workspace".to_owned());
    }
    Ok(packages.join("\n[[package]]\n"))
}

/// `text` with `to` in place of `from`, which must stand in it exactly once.
///
/// # Errors
/// When it does not.
pub(crate) fn replace_once(text: &str, from: &str, to: &str) -> Result<String, String> {
    match text.matches(from).count() {
        1 => Ok(text.replacen(from, to, 1)),
        count => Err(format!("this text stands {count} times, once is needed: {}", from.trim())),
    }
}

fn of_file(file: &Path, error: &std::io::Error) -> Failure {
    Failure(format!("{}: {error}", file.display()))
}

#[test]
fn a_copy_has_a_version_of_its_own() {
    let old = env!("CARGO_PKG_VERSION");
    let lock = format!(
        "version = 4\n\n[[package]]\nname = \"nappe-sim\"\nversion = \"{old}\"\n\n[[package]]\nname = \"x\"\nversion = \"{old}\"\nsource = \"y\"\n"
    );
    let copied = with_locked_version(&lock, "9.9.9-x").expect("a crate without a source");
    assert_eq!(copied, lock.replacen(&format!("\"{old}\""), "\"9.9.9-x\"", 1));
    assert!(with_locked_version("version = 4\n", "9.9.9-x").is_err());
    assert!(replace_once("a b a", "a", "c").is_err());
}

//! The viewer, whose SDK is more to build than all the rest: what it depends on, and whether that was proven.
//!
//! A file in the tree holds a hash of all that the viewer is made from. `cargo xtask prove viewer` lints, documents and
//! tests it and writes the hash anew; `cargo xtask check` fails where the hash is not that of the tree, so that no change
//! of the viewer lands unproven, and every other change is free of it.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    shell::{Failure, Shell, cargo},
    suites,
};

/// Where the hash is kept.
const PROVEN: &str = "viewer/proven.txt";

/// What the viewer is made from, and what starts it: its crates, the client, the contract, and the versions of all dependencies.
const SOURCES: [&str; 12] = [
    "viewer/Cargo.toml",
    "viewer/src",
    "viewer/tests",
    "viewer/rerun",
    "client/Cargo.toml",
    "client/src",
    "client/cli/src/outside/viewer",
    "client/cli/src/save/recording.rs",
    "proto/Cargo.toml",
    "proto/src",
    "proto/generated",
    "Cargo.lock",
];

/// The viewer's crates, as cargo selects them.
const CRATES: &str = "--release -p nappe-viewer -p nappe-rerun";

/// Whether the viewer was proven as it stands.
///
/// # Errors
/// When a file cannot be read.
pub(crate) fn is_proven(shell: &Shell) -> Result<bool, Failure> {
    let kept = fs::read_to_string(shell.root().join(PROVEN)).unwrap_or_default();
    Ok(kept.lines().next() == Some(hash(shell.root())?.as_str()))
}

/// Fails where the viewer has changed since it was proven.
pub(crate) fn check(shell: &mut Shell) -> Result<(), Failure> {
    shell.step("viewer as it was proven", |shell| {
        if is_proven(shell)? {
            return Ok(());
        }
        let what = SOURCES.join(", ");
        Err(Failure(format!(
            "what the viewer is made from has changed since it was proven ({what}): cargo xtask prove viewer"
        )))
    })
}

/// Lints, documents and tests the viewer, then keeps the hash of what it is made from.
pub(crate) fn prove(shell: &mut Shell) -> Result<(), Failure> {
    shell.cargo("viewer: lint", &format!("clippy {CRATES} --all-targets -- -D warnings"))?;
    let mut doc = Command::new(cargo());
    doc.arg("doc").args(CRATES.split_whitespace()).arg("--no-deps").env("RUSTDOCFLAGS", "-D warnings");
    shell.run("viewer: documentation", &mut doc)?;
    test(shell)?;
    shell.step("viewer: proven", |shell| {
        let text = format!("{}\n", hash(shell.root())?);
        fs::write(shell.root().join(PROVEN), text)
            .map_err(|error| Failure(format!("{PROVEN} cannot be written: {error}")))
    })
}

/// The suites of the viewer, and those of the command that start one.
pub(crate) fn test(shell: &mut Shell) -> Result<(), Failure> {
    suites::run(shell, "viewer: tests", CRATES, &[], suites::QUICK)?;
    // Its program was built with its tests, beside the command, which looks for it there.
    let cli = "--release --test cli";
    suites::run(shell, "viewer: as the command starts it", cli, &["viewer::"], suites::QUICK)
}

/// A hash of the names and the bytes of all sources, FNV-1a of 64 bits: it tells a change, and keeps nobody out.
fn hash(root: &Path) -> Result<String, Failure> {
    let mut files = Vec::new();
    for source in SOURCES {
        list(&root.join(source), &mut files)?;
    }
    let mut sum = Sum::new();
    for file in files {
        let name = file.strip_prefix(root).unwrap_or(&file).to_string_lossy().replace('\\', "/");
        let bytes = fs::read(&file).map_err(|error| of(&file, &error))?;
        sum.add(name.as_bytes());
        sum.add(&bytes.len().to_le_bytes());
        sum.add(&bytes);
    }
    Ok(format!("{:016x}", sum.0))
}

/// A file, or those of a folder in the order of their names, folders among them.
fn list(path: &Path, files: &mut Vec<PathBuf>) -> Result<(), Failure> {
    if !path.is_dir() {
        files.push(path.to_owned());
        return Ok(());
    }
    let entries = fs::read_dir(path).map_err(|error| of(path, &error))?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>();
    let mut paths = paths.map_err(|error| of(path, &error))?;
    paths.sort();
    paths.iter().try_for_each(|path| list(path, files))
}

fn of(path: &Path, error: &std::io::Error) -> Failure {
    Failure(format!("{} cannot be read: {error}", path.display()))
}

/// FNV-1a of 64 bits.
struct Sum(u64);

impl Sum {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

#[test]
fn the_sum_is_that_of_fnv() {
    let mut sum = Sum::new();
    sum.add(b"foobar");
    assert_eq!(sum.0, 0x8594_4171_f739_67e8);
}

#[test]
fn every_source_is_there_and_has_a_part_in_the_hash() {
    let root = Shell::at_repository_root().root().to_owned();
    for source in SOURCES {
        let mut files = Vec::new();
        list(&root.join(source), &mut files).expect("it can be read");
        assert!(files.iter().all(|file| file.is_file()) && !files.is_empty(), "{source}");
    }
    assert_eq!(hash(&root).expect("files"), hash(&root).expect("files"));
}

//! The files of the repository: what git tracks, and what it would track.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// A text file of the repository.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    /// Path from the root, with `/`.
    pub(crate) path: String,
    /// All of its text.
    pub(crate) text: String,
}

impl Source {
    /// A file made up for a test of a rule.
    pub(crate) fn example(path: &str, text: &str) -> Self {
        Self { path: path.to_owned(), text: text.to_owned() }
    }
}

/// The root of the repository.
pub(crate) fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).expect("this crate stands two folders below the root").to_path_buf()
}

/// Paths of all files, sorted.
pub(crate) fn paths() -> Vec<String> {
    let clone = root().join(".git");
    assert!(
        clone.exists(),
        "{} is missing: rules hold for the files that git lists, of a clone",
        clone.display()
    );
    let listing = run("git", &["ls-files", "--cached", "--others", "--exclude-standard"]);
    let mut paths: Vec<_> = listing.lines().map(str::to_owned).filter(|p| root().join(p).is_file()).collect();
    assert!(paths.len() > 10, "git lists the files of the repository");
    paths.sort();
    paths.dedup();
    paths
}

/// The text files whose path `wanted` accepts; files that are not UTF-8 are left out.
pub(crate) fn sources(wanted: impl Fn(&str) -> bool) -> Vec<Source> {
    let read = |path: String| fs::read_to_string(root().join(&path)).ok().map(|text| Source { path, text });
    paths().into_iter().filter(|path| wanted(path)).filter_map(read).collect()
}

/// Every Rust file that somebody wrote.
pub(crate) fn rust_sources() -> Vec<Source> {
    sources(|path| has_extension(path, "rs") && !path.starts_with("proto/generated/"))
}

/// One file that must be there.
pub(crate) fn text(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Whether `path` ends in `.extension`.
pub(crate) fn has_extension(path: &str, extension: &str) -> bool {
    Path::new(path).extension().is_some_and(|found| found == extension)
}

/// What `program` prints, run at the root.
pub(crate) fn run(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).current_dir(root()).output();
    let output = output.unwrap_or_else(|error| panic!("{program}: {error}"));
    assert!(output.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("the listing is UTF-8")
}

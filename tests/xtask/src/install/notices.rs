//! The licences of what is installed: nappe's own, and those of every crate that is in the programs, as its sources bring them.

use std::{
    collections::{BTreeMap, BTreeSet},
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::shell::{Failure, Shell, cargo};

use super::programs::failure;

/// Those of nappe itself.
const OWN: [&str; 3] = ["LICENSE", "LICENSE-APACHE", "LICENSE-MIT"];

/// The file with those of the crates.
const OTHERS: &str = "LICENSES-OF-CRATES.txt";

/// How it begins.
const HEAD: &str = "The programs of nappe hold the standard library of Rust (MIT OR Apache-2.0) and these crates, each with its\n\
    licence (SPDX) and its address. The texts that the crates bring follow, each once.\n\n";

/// What cargo is asked for: name and version, licence and address of each crate, a line each.
const TREE: &str = "tree --locked --edges normal --prefix none --format {p}|{l}|{r} \
    -p nappe-cli -p nappe-server -p nappe-viewer";

/// What cargo puts behind a crate that it has listed before.
const AGAIN: &str = " (*)";

/// How the names of files with licences begin, in small letters.
const BEGINNINGS: [&str; 5] = ["licence", "license", "copying", "notice", "unlicense"];

/// Each text of a licence, and the crates that bring it.
type Texts = BTreeMap<String, BTreeSet<String>>;

/// The files with all licences; that of the crates is written into `folder`.
///
/// # Errors
/// When cargo does not tell the crates, or the sources of one are not where cargo keeps them.
pub(super) fn files(shell: &Shell, folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let told = shell.printed(Command::new(cargo()).args(TREE.split_whitespace()))?;
    let crates = crates(&told);
    if crates.len() < 100 {
        return Err(Failure(format!("cargo tells of {} crates in the programs: too few", crates.len())));
    }
    let sources = sources()?;
    let mut texts = Texts::new();
    for name in crates.keys() {
        let found = sources.iter().map(|registry| registry.join(name)).find(|folder| folder.is_dir());
        let found =
            found.ok_or_else(|| Failure(format!("the sources of {name} are not in cargo's registry")))?;
        for file in entries(&found)?.into_iter().filter(|file| is_licence(file)) {
            let bytes = fs::read(&file).map_err(|error| failure(&file, &error))?;
            let text = String::from_utf8_lossy(&bytes).trim().to_owned();
            texts.entry(text).or_default().insert(name.clone());
        }
    }

    let others = folder.join(OTHERS);
    fs::write(&others, page(&crates, &texts)).map_err(|error| failure(&others, &error))?;
    Ok(OWN.iter().map(|name| shell.root().join(name)).chain([others]).collect())
}

/// The crates of registries, `name-version` as the folders of their sources are called, each with licence and address.
fn crates(told: &str) -> BTreeMap<String, String> {
    let of_line = |line: &str| {
        let mut parts = line.trim_end_matches(AGAIN).split('|');
        let (package, licence, address) = (parts.next()?, parts.next()?, parts.next()?);
        // In parentheses stand the folder of a crate of the workspace, and that a crate runs within the compiler alone.
        let (name, version) = package.split_once(" v").filter(|_| !package.contains('('))?;
        Some((format!("{name}-{version}"), format!("{licence} {address}").trim().to_owned()))
    };
    told.lines().filter_map(of_line).collect()
}

/// The folders in which cargo keeps the sources of crates, one for each registry.
fn sources() -> Result<Vec<PathBuf>, Failure> {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(PathBuf::from(env::var_os("HOME")?).join(".cargo")));
    let home = home.ok_or_else(|| Failure("neither CARGO_HOME nor HOME says where cargo is".to_owned()))?;
    entries(&home.join("registry/src"))
}

/// What is in a folder, in the order of the names.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let read = fs::read_dir(folder).map_err(|error| failure(folder, &error))?;
    let mut entries: Vec<_> = read.filter_map(|entry| Some(entry.ok()?.path())).collect();
    entries.sort();
    Ok(entries)
}

fn is_licence(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    file.is_file() && BEGINNINGS.iter().any(|beginning| name.starts_with(beginning))
}

/// The text of the file: a list of the crates, then each licence once.
fn page(crates: &BTreeMap<String, String>, texts: &Texts) -> String {
    let list: Vec<_> = crates.iter().map(|(name, what)| format!("{name}: {what}\n")).collect();
    let licence = |(text, names): (&String, &BTreeSet<String>)| {
        let names = names.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
        format!("\n==== {names}\n\n{text}\n")
    };
    let licences: Vec<_> = texts.iter().map(licence).collect();
    [HEAD, &list.concat(), &licences.concat()].concat()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{Texts, crates, page};

    #[test]
    fn crates_of_registries_are_listed_once_with_their_licences() {
        let told = "nappe-cli v0.1.0 (/tmp/nappe/client/cli)|MIT OR Apache-2.0|\nbytes v1.10.1|MIT|https://e.org\n\n\
            serde_derive v1.0.1 (proc-macro)|MIT|https://e.org\nbytes v1.10.1|MIT|https://e.org (*)\nlibm v0.2.15|MIT|\n";
        let crates = crates(told);
        let names: Vec<_> = crates.keys().map(String::as_str).collect();
        assert_eq!(names, ["bytes-1.10.1", "libm-0.2.15"]);
        let texts = Texts::from([("Do.".to_owned(), BTreeSet::from(["bytes-1.10.1".to_owned()]))]);
        let page = page(&crates, &texts);
        assert!(page.contains("\nbytes-1.10.1: MIT https://e.org\nlibm-0.2.15: MIT\n"), "{page}");
        assert!(page.ends_with("\n==== bytes-1.10.1\n\nDo.\n"), "{page}");
    }
}

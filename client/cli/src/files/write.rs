//! Files that the command makes: what is there already stays, unless `--force` is given.
//!
//! Every verb that makes files makes them here.

use std::{
    fs::{self, File},
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use clap::Args;
use nappe_scene::files;
pub(crate) use nappe_scene::files::Existing;

use crate::words::error::{CliError, Result};

/// The option that every verb which makes files has.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(crate) struct ForceArgs {
    /// Overwrite what is there already
    #[arg(long, help_heading = "Output")]
    force: bool,
}

impl ForceArgs {
    /// As if it was given.
    pub(crate) const GIVEN: Self = Self { force: true };

    /// What becomes of files that are there.
    pub(crate) fn existing(self) -> Existing {
        if self.force { Existing::Overwritten } else { Existing::Kept }
    }
}

/// Makes a file, empty.
///
/// # Errors
/// A file that is there and stays, and those of the system.
pub(crate) fn create(path: &Path, existing: Existing) -> Result<File> {
    files::create(path, existing).map_err(|error| refused(path, &error))
}

/// Makes a file of these bytes, whole or not at all, as [`write_by`], and has the disk hold it.
///
/// # Errors
/// As [`create`].
pub(crate) fn write_whole(path: &Path, bytes: &[u8], existing: Existing) -> Result<()> {
    write_by(path, existing, |file| {
        file.write_all(bytes)?;
        // A device or a pipe has no disk.
        if file.metadata()?.is_file() { file.sync_all() } else { Ok(()) }
    })
}

/// Makes a file of what is written into it, whole or not at all: it is written beside it, under its name with `.new` behind,
/// which then takes its place. Where that fails, what was there stays. A device or a pipe is written as it is.
///
/// # Errors
/// As [`create`].
pub(crate) fn write_by(
    path: &Path,
    existing: Existing,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<()> {
    if is_special(path) {
        return write(&mut create(path, existing)?).map_err(|error| refused(path, &error));
    }
    check(path, existing)?;
    let place = place(path);
    let new = beside(&place);
    let blamed = if new.is_dir() { new.as_path() } else { path };
    let mut file = File::create(&new).map_err(|error| refused(blamed, &error))?;
    let written = write(&mut file);
    drop(file);
    written.and_then(|()| put(&new, &place, existing)).map_err(|error| {
        // The first error is told; what cannot be removed either is in nobody's way.
        let _ = fs::remove_file(&new);
        refused(path, &error)
    })
}

/// Whether something is there that is no plain file, so that nothing takes its place.
pub(crate) fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|there| !there.is_file())
}

/// What is replaced at a path: of a link, what it leads to.
pub(crate) fn place(path: &Path) -> PathBuf {
    if path.is_symlink() {
        fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
    } else {
        path.to_owned()
    }
}

/// Where a file is written until it is whole.
pub(crate) fn beside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    name.into()
}

/// Gives a file its place. One that came there meanwhile stays, if files stay.
///
/// # Errors
/// Those of the system; [`io::ErrorKind::AlreadyExists`] where a file stays.
pub(crate) fn put(new: &Path, place: &Path, existing: Existing) -> io::Result<()> {
    if existing == Existing::Overwritten {
        return fs::rename(new, place);
    }
    match fs::hard_link(new, place) {
        Ok(()) => fs::remove_file(new),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(error),
        // A file system without such links: the name is taken by an empty file, which is then replaced.
        Err(_) => {
            File::create_new(place)?;
            fs::rename(new, place)
        }
    }
}

/// Refuses a file that would be lost, before anything is computed.
///
/// # Errors
/// A file that is there and stays.
pub(crate) fn check(path: &Path, existing: Existing) -> Result<()> {
    if existing == Existing::Kept && path.is_file() { Err(stays(path)) } else { Ok(()) }
}

/// The failure of a file that is there and stays.
pub(crate) fn stays(path: &Path) -> CliError {
    CliError::failure(format!("{} is there already: --force overwrites it", path.display()))
}

/// The failure of a file that cannot be written.
pub(crate) fn refused(path: &Path, error: &io::Error) -> CliError {
    match error.kind() {
        io::ErrorKind::AlreadyExists => stays(path),
        _ => CliError::file("write", path, error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A new, empty folder.
    fn folder(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("nappe-write-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).expect("a temporary folder");
        path
    }

    /// What stands in a folder.
    fn names(folder: &Path) -> Vec<String> {
        let entries =
            fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
        let mut names: Vec<String> = entries.map(|name| name.to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_whole_or_stays_and_nothing_is_left_beside_it() {
        let folder = folder("whole");
        let path = folder.join("a.csv");
        write_whole(&path, b"first", Existing::Kept).expect("a new file");
        let error = write_whole(&path, b"second", Existing::Kept).expect_err("it is there").to_string();
        assert!(error.contains("a.csv is there already: --force overwrites it"), "{error}");
        assert_eq!(fs::read(&path).expect("it is there"), b"first");
        write_whole(&path, b"second", Existing::Overwritten).expect("it is replaced");
        assert_eq!(fs::read(&path).expect("it is there"), b"second");
        // One that came while another was written.
        fs::write(beside(&path), "third").expect("a file");
        let error = put(&beside(&path), &path, Existing::Kept).expect_err("it is there");
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&path).expect("it is there"), b"second");
        fs::remove_file(beside(&path)).expect("it is there");
        assert_eq!(names(&folder), ["a.csv"]);
        fs::remove_dir_all(folder).expect("it goes");
    }

    #[test]
    fn a_name_that_a_folder_takes_is_told() {
        let folder = folder("taken");
        let path = folder.join("a.csv");
        fs::create_dir(beside(&path)).expect("a folder");
        let error = write_whole(&path, b"a", Existing::Overwritten).expect_err("no file").to_string();
        assert!(error.contains("a.csv.new: "), "{error}");
        assert_eq!(names(&folder), ["a.csv.new"]);
        fs::remove_dir_all(folder).expect("it goes");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn on_a_full_disk_the_old_file_stays_and_the_message_names_it() {
        let folder = folder("full");
        let path = folder.join("a.csv");
        fs::write(&path, "old").expect("a file");
        // Whoever writes there is told that the disk is full.
        std::os::unix::fs::symlink("/dev/full", beside(&path)).expect("a link");
        let error = write_whole(&path, b"new", Existing::Overwritten).expect_err("it is full").to_string();
        assert!(error.contains("cannot write") && error.contains("a.csv: "), "{error}");
        assert_eq!(fs::read(&path).expect("it is there"), b"old");
        assert_eq!(names(&folder), ["a.csv"]);
        // A device is opened as it is.
        let device = Path::new("/dev/full");
        assert!(write_whole(device, b"new", Existing::Kept).is_err());
        write_whole(Path::new("/dev/null"), b"new", Existing::Kept).expect("it takes everything");
        fs::remove_dir_all(folder).expect("it goes");
    }
}

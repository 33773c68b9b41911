//! A file on its way: it is written beside its name, with `.new` behind, and takes the name once it is whole.
//!
//! Until then an earlier file stays. What a killed run leaves has the name with `.new`, and the next run takes its place.

use std::{
    fs::{self, File, TryLockError},
    io::{self, BufWriter, Write as _},
    path::{Path, PathBuf},
};

use crate::{
    files::write::{self, Existing},
    words::error::{CliError, Result},
};

/// Where a file goes, and where it is until then.
#[derive(Debug)]
pub(crate) struct Aside {
    /// As it was named.
    path: PathBuf,
    /// What a link at the path leads to, or the path.
    place: PathBuf,
    new: PathBuf,
    existing: Existing,
}

impl Aside {
    /// Makes room beside a path; none for a device, a pipe or a folder, which nothing takes the place of.
    ///
    /// # Errors
    /// A file that is there and stays, and one that another run is writing.
    pub(crate) fn of(path: &Path, existing: Existing) -> Result<Option<Self>> {
        if write::is_special(path) {
            return Ok(None);
        }
        write::check(path, existing)?;
        let place = write::place(path);
        let aside = Self { path: path.to_owned(), new: write::beside(&place), place, existing };
        aside.clear()?;
        Ok(Some(aside))
    }

    /// Where the file is until it is whole.
    pub(crate) fn file(&self) -> &Path {
        &self.new
    }

    /// Removes what a killed run left there.
    fn clear(&self) -> Result<()> {
        let refused = |error: &io::Error| match error.kind() {
            io::ErrorKind::NotFound => Ok(()),
            _ => Err(CliError::file("write", &self.new, error)),
        };
        let left = match File::options().write(true).open(&self.new) {
            Ok(left) => left,
            Err(error) => return refused(&error),
        };
        // Whoever writes it holds its lock. Where files have no locks, nobody is known to.
        if matches!(left.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(self.in_use());
        }
        fs::remove_file(&self.new).or_else(|error| refused(&error))
    }

    fn in_use(&self) -> CliError {
        CliError::failure(format!("{} is being written by another run", self.path.display()))
    }

    /// Gives the file its name, if there is one.
    ///
    /// # Errors
    /// A file that came there meanwhile and stays, and those of the system.
    pub(crate) fn keep(&self) -> Result<()> {
        if !self.new.exists() {
            return Ok(());
        }
        let put = write::put(&self.new, &self.place, self.existing);
        put.map_err(|error| self.told(write::refused(&self.path, &error)))
    }

    /// An error after which the file does not get its name. An empty one goes; where another is, the user is told.
    pub(crate) fn told(&self, error: CliError) -> CliError {
        match fs::metadata(&self.new) {
            Ok(left) if left.len() == 0 => {
                self.discard();
                error
            }
            Ok(_) if error.hint.is_none() => {
                error.hint(format!("what was written until then is {}", self.new.display()))
            }
            _ => error,
        }
    }

    /// Removes the file.
    fn discard(&self) {
        // What cannot be removed is in nobody's way.
        let _ = fs::remove_file(&self.new);
    }
}

/// A file that this command writes piece by piece.
#[derive(Debug)]
pub(crate) struct Growing {
    path: PathBuf,
    /// None for a device or a pipe, and once the file has its name.
    aside: Option<Aside>,
    out: BufWriter<File>,
    bytes: u64,
    /// Whether a piece is missing.
    is_torn: bool,
}

impl Growing {
    /// Opens a file beside its name.
    ///
    /// # Errors
    /// As [`Aside::of`], and those of the system.
    pub(crate) fn open(path: &Path, existing: Existing) -> Result<Self> {
        let aside = Aside::of(path, existing)?;
        let file = match &aside {
            None => write::create(path, existing)?,
            Some(aside) => {
                let made = File::create_new(aside.file()).map_err(|error| match error.kind() {
                    io::ErrorKind::AlreadyExists => aside.in_use(),
                    _ => CliError::file("write", path, &error),
                })?;
                if matches!(made.try_lock(), Err(TryLockError::WouldBlock)) {
                    return Err(aside.in_use());
                }
                made
            }
        };
        Ok(Self { path: path.to_owned(), aside, out: BufWriter::new(file), bytes: 0, is_torn: false })
    }

    /// The file as it was named.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes that it was given.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Writes a piece.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.bytes += bytes.len() as u64;
        let written = self.out.write_all(bytes);
        written.map_err(|error| self.refused(&error))
    }

    /// Has the file hold all that it was given.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(crate) fn flush(&mut self) -> Result<()> {
        let flushed = self.out.flush();
        flushed.map_err(|error| self.refused(&error))
    }

    /// Gives the file its name. One in which nothing was written goes.
    ///
    /// # Errors
    /// When the file cannot be written, and as [`Aside::keep`].
    pub(crate) fn finish(mut self) -> Result<()> {
        self.flush()?;
        if self.bytes == 0 {
            return Ok(());
        }
        if self.is_torn {
            let error = io::Error::other("a part of it could not be written");
            return Err(self.refused(&error));
        }
        if self.aside.is_some() {
            let synced = self.out.get_ref().sync_all();
            synced.map_err(|error| self.refused(&error))?;
        }
        self.aside.take().map_or(Ok(()), |aside| aside.keep())
    }

    fn refused(&mut self, error: &io::Error) -> CliError {
        self.is_torn = true;
        let error = CliError::file("write", &self.path, error);
        match &self.aside {
            Some(aside) => aside.told(error),
            None => error,
        }
    }
}

impl Drop for Growing {
    /// A file in which nothing was written goes.
    fn drop(&mut self) {
        if let Some(aside) = &self.aside
            && self.bytes == 0
        {
            aside.discard();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A new, empty folder.
    fn folder(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("nappe-aside-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).expect("a temporary folder");
        path
    }

    #[test]
    fn an_earlier_file_stays_until_the_new_one_is_whole() {
        let folder = folder("whole");
        let (path, new) = (folder.join("a.html"), folder.join("a.html.new"));
        // As a killed run leaves it.
        fs::write(&new, "cut off").expect("a file");
        fs::write(&path, "first").expect("a file");
        assert!(Growing::open(&path, Existing::Kept).is_err());
        let mut growing = Growing::open(&path, Existing::Overwritten).expect("it may be overwritten");
        growing.write(b"second").expect("there is room");
        growing.flush().expect("there is room");
        assert_eq!(fs::read(&path).expect("it is there"), b"first");
        assert_eq!(fs::read(&new).expect("it is there"), b"second");
        let error = Growing::open(&path, Existing::Overwritten).expect_err("it is locked").to_string();
        assert!(error.contains("a.html is being written by another run"), "{error}");
        growing.finish().expect("it is whole");
        assert_eq!((fs::read(&path).expect("it is there"), new.exists()), (b"second".to_vec(), false));
        fs::remove_dir_all(folder).expect("it goes");
    }

    #[test]
    fn nothing_is_left_of_a_file_that_was_given_nothing() {
        let folder = folder("nothing");
        let path = folder.join("a.html");
        drop(Growing::open(&path, Existing::Kept).expect("a new file"));
        Growing::open(&path, Existing::Kept).expect("a new file").finish().expect("nothing to write");
        assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 0);
        // One that was written in part stays beside the name, and is told.
        let mut growing = Growing::open(&path, Existing::Kept).expect("a new file");
        growing.write(b"half").expect("there is room");
        growing.flush().expect("there is room");
        let aside = growing.aside.as_ref().expect("a plain file");
        let hint = aside.told(CliError::failure("no")).hint.expect("it is there");
        assert!(hint.ends_with("a.html.new"), "{hint}");
        drop(growing);
        assert_eq!(
            (path.exists(), fs::read(folder.join("a.html.new")).expect("it is there")),
            (false, b"half".to_vec())
        );
        fs::remove_dir_all(folder).expect("it goes");
    }

    #[test]
    fn a_file_that_came_meanwhile_stays() {
        let folder = folder("meanwhile");
        let path = folder.join("a.rrd");
        let aside = Aside::of(&path, Existing::Kept).expect("there is none").expect("a plain file");
        aside.keep().expect("nothing was written");
        fs::write(aside.file(), "mine").expect("a file");
        fs::write(&path, "theirs").expect("a file");
        let error = aside.keep().expect_err("it is there").to_string();
        assert!(error.contains("is there already: --force overwrites it"), "{error}");
        assert_eq!(fs::read(&path).expect("it is there"), b"theirs");
        assert_eq!(fs::read(aside.file()).expect("it is there"), b"mine");
        fs::remove_dir_all(folder).expect("it goes");
    }
}

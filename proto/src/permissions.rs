//! Owners and permissions of files, as the system has them.

#[cfg(not(unix))]
pub(crate) use elsewhere::{check_readers, is_private, is_same, make_private, own_uid, private_file};
#[cfg(unix)]
pub(crate) use unix::{check_readers, is_private, is_same, make_private, own_uid, private_file};

/// Owners and permissions as Unix has them.
#[cfg(unix)]
mod unix {
    use std::{
        env, fs,
        fs::{DirBuilder, File, Metadata, OpenOptions},
        io,
        os::unix::fs::{DirBuilderExt as _, MetadataExt as _, OpenOptionsExt as _},
        path::Path,
    };

    /// The user that this process runs as: the owner of its entry in /proc, or of the home folder where there is
    /// no /proc.
    pub(crate) fn own_uid() -> io::Result<u32> {
        let home = || env::home_dir().ok_or(io::ErrorKind::NotFound.into()).and_then(fs::metadata);
        Ok(fs::metadata("/proc/self").or_else(|_none| home())?.uid())
    }

    /// Whether the user alone can read and enter it.
    pub(crate) fn is_private(metadata: &Metadata) -> bool {
        (metadata.mode() | 0o700) & 0o777 == 0o700 && own_uid().is_ok_and(|uid| metadata.uid() == uid)
    }

    /// Refuses a file that every user of this machine may read or write. Its owner may share it with a group, and a pipe
    /// is read by whoever was given it.
    ///
    /// # Errors
    /// With the command that mends it.
    pub(crate) fn check_readers(file: &File, path: &Path) -> io::Result<()> {
        let metadata = file.metadata()?;
        if !metadata.is_file() || metadata.mode() & 0o006 == 0 {
            return Ok(());
        }
        let (mode, path) = (metadata.mode() & 0o777, path.display());
        let message = format!(
            "every user of this machine may read or write it (mode {mode:03o}); allowed: its owner, and a group: `chmod 600 {path}`"
        );
        Err(io::Error::new(io::ErrorKind::PermissionDenied, message))
    }

    /// Makes a folder that the user alone can enter, or finds that it is one.
    pub(crate) fn make_private(folder: &Path) -> io::Result<()> {
        match DirBuilder::new().mode(0o700).create(folder) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
            _ => {}
        }
        // Of the folder itself: a link could lead to somebody else's.
        let metadata = fs::symlink_metadata(folder)?;
        if metadata.is_dir() && is_private(&metadata) {
            return Ok(());
        }
        let message = "it is not a folder that this user owns and nobody else can enter";
        Err(io::Error::new(io::ErrorKind::InvalidData, message))
    }

    /// A new file that the user alone can read.
    pub(crate) fn private_file(path: &Path) -> io::Result<File> {
        // A process of the same number may have died here.
        let _ = fs::remove_file(path);
        OpenOptions::new().read(true).write(true).create_new(true).mode(0o600).open(path)
    }

    /// Whether the file is the one that has this path.
    pub(crate) fn is_same(file: &File, path: &Path) -> bool {
        let place = |metadata: Metadata| (metadata.dev(), metadata.ino());
        let (file, path) = (file.metadata().map(place), fs::metadata(path).map(place));
        matches!((file, path), (Ok(file), Ok(path)) if file == path)
    }
}

/// Systems where temporary files are each user's own.
#[cfg(not(unix))]
mod elsewhere {
    use std::{
        fs::{self, File, Metadata, OpenOptions},
        io,
        path::Path,
    };

    pub(crate) fn own_uid() -> io::Result<u32> {
        Ok(0)
    }

    pub(crate) fn is_private(_: &Metadata) -> bool {
        true
    }

    pub(crate) fn check_readers(_: &File, _: &Path) -> io::Result<()> {
        Ok(())
    }

    pub(crate) fn make_private(folder: &Path) -> io::Result<()> {
        fs::create_dir_all(folder)
    }

    pub(crate) fn private_file(path: &Path) -> io::Result<File> {
        OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path)
    }

    pub(crate) fn is_same(_: &File, path: &Path) -> bool {
        path.exists()
    }
}

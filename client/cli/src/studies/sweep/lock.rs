//! One sweep per folder at a time: the lock that it holds while it runs.

use std::{
    fs::{File, TryLockError},
    path::Path,
};

use crate::words::{
    error::{CliError, Result},
    output,
};

/// Takes the lock of a folder, until the file that is returned is closed, however the program ends. The file itself stays there,
/// empty: who removed it might remove that of another sweep.
///
/// # Errors
/// A folder in which another sweep is running, and a file that cannot be made.
pub(crate) fn take(folder: &Path) -> Result<File> {
    let path = folder.join("sweep.lock");
    let opened = File::options().write(true).create(true).truncate(false).open(&path);
    let file = opened.map_err(|error| CliError::file("write", &path, &error))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            return Err(CliError::usage(format!("another sweep is running in {}", folder.display()))
                .hint("wait for its end, or name another folder with --out"));
        }
        Err(TryLockError::Error(error)) => output::note(&format!(
            "{} cannot be locked ({error}): start no other sweep in this folder",
            path.display()
        )),
    }
    Ok(file)
}

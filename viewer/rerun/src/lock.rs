//! The lock of a recording's file: two recordings at once would mix their bytes.
//!
//! It is advisory, and held by an open file: it is gone with the process, however that ends.

#[cfg(unix)]
use std::fs::TryLockError;
use std::{fs::File, path::Path};

use crate::error::RerunError;

/// Locks the file of a recording, before the SDK empties it. Where files cannot be locked, or this one cannot be
/// opened, nothing is locked, and the SDK says what is wrong.
///
/// # Errors
/// If another recording holds the lock.
#[cfg(unix)]
pub(crate) fn lock(path: &Path) -> Result<Option<File>, RerunError> {
    let Ok(file) = File::options().write(true).create(true).truncate(false).open(path) else {
        return Ok(None);
    };
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Err(RerunError::InUse { path: path.to_owned() }),
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

/// Locks nothing: on other systems a lock would keep the SDK from its own file.
#[cfg(not(unix))]
#[allow(clippy::unnecessary_wraps, reason = "on Unix it can fail")]
pub(crate) fn lock(_: &Path) -> Result<Option<File>, RerunError> {
    Ok(None)
}

//! Files that the command makes: what is there already stays, unless `--force` is given.
//!
//! Every verb that makes files makes them here.

use std::{
    fs::File,
    io::{self, Write as _},
    path::Path,
};

use clap::Args;
use nappe_scene::files;
pub(crate) use nappe_scene::files::Existing;

use crate::error::{CliError, Result};

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

/// Opens a file that may be overwritten, with what it holds until then; makes it where it stays.
///
/// # Errors
/// As [`create`].
pub(crate) fn open(path: &Path, existing: Existing) -> Result<File> {
    match existing {
        Existing::Kept => create(path, existing),
        Existing::Overwritten => {
            let opened = File::options().write(true).create(true).truncate(false).open(path);
            opened.map_err(|error| refused(path, &error))
        }
    }
}

/// Makes a file of these bytes.
///
/// # Errors
/// As [`create`].
pub(crate) fn write(path: &Path, bytes: &[u8], existing: Existing) -> Result<()> {
    create(path, existing)?.write_all(bytes).map_err(|error| refused(path, &error))
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

fn refused(path: &Path, error: &io::Error) -> CliError {
    match error.kind() {
        io::ErrorKind::AlreadyExists => stays(path),
        _ => CliError::file("write", path, error),
    }
}

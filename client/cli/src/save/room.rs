//! Room for the files of a run in a folder: beside those of another run until the end, in whose place they then are.
//!
//! Enters: a folder. Leaves: where each file is written; at the end, the files of this run alone.

use std::{
    fs::{self, File, TryLockError},
    io,
    path::{Path, PathBuf},
};

use crate::{
    files::write::Existing,
    words::error::{CliError, Result},
};

/// Where the frames are until they replace those of another run, within the folder.
const ASIDE: &str = "frames.new";

/// The file of all mesh colliders.
pub(super) const COLLIDERS: &str = "colliders.ply";

/// A folder for the files of a run.
pub(super) struct Room {
    path: PathBuf,
    /// Where the files are written: the folder, or one within it while files of another run are there.
    place: PathBuf,
    /// Folders that were made for it, inner ones first.
    made: Vec<PathBuf>,
    /// Whether files of another run go before the first one of this.
    is_cleared: bool,
    /// Whether a file came.
    is_begun: bool,
    /// Holds the folder's lock, so that no other run writes there; none where folders have no locks.
    _lock: Option<File>,
}

impl Room {
    /// Makes the folder, or takes one that holds no frames that stay.
    ///
    /// # Errors
    /// When it cannot be made or read, holds frames that stay, or another run writes there.
    pub(super) fn create(path: &Path, existing: Existing) -> Result<Self> {
        let missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        let made = path.ancestors().take_while(missing).map(Path::to_owned).collect();
        fs::create_dir_all(path).map_err(|error| CliError::file("make the folder", path, &error))?;
        let old = frames(path).map_err(|error| CliError::file("read the folder", path, &error))?;
        if let Some(name) = old.first().and_then(|file| file.file_name())
            && existing == Existing::Kept
        {
            return Err(CliError::failure(format!(
                "the folder {} holds frames already ({}): two runs would be mixed up",
                path.display(),
                name.display(),
            ))
            .hint("--force removes them; or give another folder"));
        }
        let lock = locked(path)?;
        let place = if old.is_empty() { path.to_owned() } else { path.join(ASIDE) };
        Ok(Self { path: path.to_owned(), place, made, is_cleared: false, is_begun: false, _lock: lock })
    }

    /// The same, where the files of another run go before the first one comes: those of a run that is cut off are where it goes on.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub(super) fn cleared(path: &Path, existing: Existing) -> Result<Self> {
        let mut room = Self::create(path, existing)?;
        room.is_cleared = room.is_aside();
        room.place = room.path.clone();
        Ok(room)
    }

    /// A folder in which a run goes on.
    ///
    /// # Errors
    /// When another run writes there.
    pub(super) fn going_on(path: &Path) -> Result<Self> {
        let lock = locked(path)?;
        let path = path.to_owned();
        Ok(Self {
            place: path.clone(),
            path,
            made: Vec::new(),
            is_cleared: false,
            is_begun: false,
            _lock: lock,
        })
    }

    /// Whether frames of another run are there.
    pub(super) fn is_aside(&self) -> bool {
        self.place != self.path
    }

    /// Makes the folder within before the first file, without what a killed run left there; or removes what goes then.
    ///
    /// # Errors
    /// When it or a file cannot be removed, or it cannot be made.
    pub(super) fn begin(&mut self) -> Result<()> {
        if self.is_begun {
            return Ok(());
        }
        if self.is_aside() {
            let cleared = match fs::remove_dir_all(&self.place) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
                removed => removed,
            };
            let made = cleared.and_then(|()| fs::create_dir(&self.place));
            made.map_err(|error| CliError::file("make the folder", &self.place, &error))?;
        }
        if self.is_cleared {
            let old = frames(&self.path);
            for file in old.map_err(|error| CliError::file("read the folder", &self.path, &error))? {
                fs::remove_file(&file).map_err(|error| CliError::file("remove", &file, &error))?;
            }
        }
        self.is_begun = true;
        Ok(())
    }

    /// Where a file is written.
    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.place.join(name)
    }

    /// The folder in which files are until the end, beside those of another run; none where there are none of another.
    pub(super) fn aside(&self) -> Option<&'static str> {
        self.is_aside().then_some(ASIDE)
    }

    /// Has the files take the place of those of another run. None came: those stay.
    ///
    /// # Errors
    /// When one cannot be removed or renamed.
    pub(super) fn finish(&self) -> Result<()> {
        if !self.is_begun || !self.is_aside() {
            return Ok(());
        }
        self.replace().map_err(|(verb, file, error)| self.told(CliError::file(verb, &file, &error)))
    }

    /// An error after which the files of another run stay.
    pub(super) fn told(&self, error: CliError) -> CliError {
        if self.is_aside() && error.hint.is_none() {
            error.hint(format!("the frames until then are in {}", self.place.display()))
        } else {
            error
        }
    }

    /// Removes the files of another run, and moves those of this one.
    fn replace(&self) -> Moved {
        let listed =
            |folder: &Path| frames(folder).map_err(|error| ("read the folder", folder.to_owned(), error));
        let new = listed(&self.place)?;
        for file in listed(&self.path)? {
            fs::remove_file(&file).map_err(|error| ("remove", file, error))?;
        }
        for file in new {
            let Some(name) = file.file_name() else { continue };
            let moved = fs::rename(&file, self.path.join(name));
            moved.map_err(|error| ("rename", file, error))?;
        }
        fs::remove_dir(&self.place).map_err(|error| ("remove", self.place.clone(), error))
    }
}

impl Drop for Room {
    /// Folders that were made for files that did not come go.
    fn drop(&mut self) {
        if !self.is_begun {
            for folder in &self.made {
                // One that holds something meanwhile stays.
                let _ = fs::remove_dir(folder);
            }
        }
    }
}

/// The lock of a folder, which goes with the process that holds it; none where folders cannot be opened or locked.
///
/// # Errors
/// When another run holds it.
fn locked(path: &Path) -> Result<Option<File>> {
    let Ok(folder) = File::open(path) else { return Ok(None) };
    match folder.try_lock() {
        Ok(()) => Ok(Some(folder)),
        Err(TryLockError::WouldBlock) => {
            Err(CliError::failure(format!("another run is writing into the folder {}", path.display())))
        }
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

/// The files of a run in a folder: frames, grids, colliders, for whatever program.
fn frames(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let is_numbered = ["frame-", "grid-", "colliders-"].iter().any(|start| name.starts_with(start));
        let is_written = entry.path().extension().is_some_and(|ending| ending == "ply" || ending == "vtp");
        if name == COLLIDERS || (is_numbered && is_written) {
            found.push(entry.path());
        }
    }
    found.sort();
    Ok(found)
}

/// What could not be done, with which file, and why.
type Moved = std::result::Result<(), (&'static str, PathBuf, io::Error)>;

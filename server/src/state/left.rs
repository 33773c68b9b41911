//! What a server leaves of its sessions in a folder: states, each a file of a session without its setup, and setups.
//!
//! Enters: folders, which another server may use meanwhile. Leaves: whole files of sessions.

use std::{
    fs::{self, File},
    io::{self, Read as _},
    path::Path,
};

use super::{
    files::names,
    format::{Digest, FRONT_BYTES, Opened, needed_setup},
};

/// The folder of setups, beside that of sessions.
pub(super) const SETUPS: &str = "setups";
/// How the name of a state begins.
pub(super) const STATE: &str = "state";

/// Where a state stands among those of its session, and how many steps had been taken. Its log has the same place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct StatePlace {
    /// Counts the states of a session, from 1.
    pub number: u64,
    pub step: u64,
}

impl StatePlace {
    /// The name of its file of this kind.
    pub(super) fn name(self, kind: &str) -> String {
        format!("{kind}-{}-{}", self.number, self.step)
    }

    /// The place that a name of a file of this kind says.
    pub(super) fn of(name: &str, kind: &str) -> Option<Self> {
        let (number, step) = name.strip_prefix(kind)?.strip_prefix('-')?.split_once('-')?;
        let place = Self { number: number.parse().ok()?, step: step.parse().ok()? };
        // A number has one name.
        (place.name(kind) == name).then_some(place)
    }
}

/// The places of the files of a kind in the folder of a session, in order.
///
/// # Errors
/// If the folder cannot be read.
pub(super) fn places(session: &Path, kind: &str) -> io::Result<Vec<StatePlace>> {
    let names = names(session)?;
    let mut places: Vec<_> = names.iter().filter_map(|name| StatePlace::of(name, kind)).collect();
    places.sort_unstable();
    Ok(places)
}

/// The setup that a state needs, and where it belongs in the file.
///
/// # Errors
/// If the state cannot be read, or its beginning is damaged or of another version.
pub(super) fn setup_of(session: &Path, place: StatePlace) -> io::Result<(Digest, u64)> {
    let mut beginning = Vec::with_capacity(FRONT_BYTES);
    let file = File::open(session.join(place.name(STATE)))?;
    file.take(FRONT_BYTES as u64).read_to_end(&mut beginning)?;
    needed_setup(&beginning).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}

/// A state in the folder of a session as a whole file, with its setup, which is in the folder `setups`.
///
/// # Errors
/// If it cannot be read, or its beginning is damaged; the rest was not checked yet.
pub(super) fn whole(session: &Path, setups: &Path, place: StatePlace) -> io::Result<Vec<u8>> {
    let (setup, at) = setup_of(session, place)?;
    let without = fs::read(session.join(place.name(STATE)))?;
    let path = setups.join(setup_name(setup));
    let named = |error: io::Error| io::Error::new(error.kind(), format!("{}: {error}", path.display()));
    let cut = || io::Error::new(io::ErrorKind::UnexpectedEof, "it was cut before its setup");
    if fs::metadata(&path).map_err(named)?.len() != setup.length {
        let error = io::Error::new(io::ErrorKind::InvalidData, "it was cut, or something was added");
        return Err(named(error));
    }
    let section = fs::read(&path).map_err(named)?;
    let at = usize::try_from(at).map_err(io::Error::other)?;
    let (before, after) = without.split_at_checked(at).ok_or_else(cut)?;
    Ok([before, section.as_slice(), after].concat())
}

/// The newest good state of a session that a server keeps, or kept, in the folder `DIR/sessions/UID`, as a file of a session. What its
/// log says happened since is not in it.
///
/// # Errors
/// If the folder cannot be read, or has no good state.
pub fn newest_state(session: &Path) -> io::Result<Vec<u8>> {
    let session = session.canonicalize()?;
    let setups = session.ancestors().nth(2).unwrap_or(&session).join(SETUPS);
    let mut refused = None;
    for place in places(&session, STATE)?.into_iter().rev() {
        match whole(&session, &setups, place).and_then(checked) {
            Ok(file) => return Ok(file),
            Err(error) => {
                let message = format!("{}: {error}", place.name(STATE));
                refused.get_or_insert(io::Error::new(error.kind(), message));
            }
        }
    }
    Err(refused.unwrap_or_else(|| {
        let message =
            "it has no state of a session: a folder DIR/sessions/UID of a server with --state-dir DIR has";
        io::Error::new(io::ErrorKind::NotFound, message)
    }))
}

/// The file, if its hashes are those of its sections.
fn checked(file: Vec<u8>) -> io::Result<Vec<u8>> {
    match Opened::of(&file) {
        Ok(_) => Ok(file),
        Err(error) => Err(io::Error::new(io::ErrorKind::InvalidData, error)),
    }
}

/// Whether a file has the name of a setup.
pub(super) fn is_setup(name: &str) -> bool {
    let setup = name.split_once('-').and_then(|(hash, length)| {
        Some(Digest { hash: u64::from_str_radix(hash, 16).ok()?, length: length.parse().ok()? })
    });
    setup.is_some_and(|setup| setup_name(setup) == name)
}

/// The name of the file of a setup.
pub(super) fn setup_name(Digest { length, hash }: Digest) -> String {
    format!("{hash:016x}-{length}")
}

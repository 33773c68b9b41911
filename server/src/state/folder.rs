//! The folder in which a server keeps its sessions.
//!
//! `lock` is held by the server that uses it. `token` is what its callers show. `setups` has the setups of worlds, each named after its
//! hash and its length. `sessions` has a folder for each session, named after its uid, with the newest two states, `state-NUMBER-STEP`,
//! each a file of a session without its setup, and the logs since, `log-NUMBER-STEP`. Every file but a log is renamed into place.

use std::{
    fs::{self, File, OpenOptions},
    io,
    os::unix::fs::{MetadataExt as _, OpenOptionsExt as _},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use rustix::process::geteuid;

use super::{
    files::{bytes_in, digest_of, make_folder, names, put, unfinished},
    format::Digest,
    left::{SETUPS, STATE, StatePlace, is_setup, places, setup_name, setup_of, whole},
};

/// The folder of sessions.
const SESSIONS: &str = "sessions";
/// How the name of a log begins.
const LOG: &str = "log";
/// States of a session that are kept.
const KEPT_STATES: usize = 2;

/// A folder that this server alone uses.
#[derive(Debug)]
pub(crate) struct StateFolder {
    path: PathBuf,
    /// Bytes of all files at most.
    most_bytes: u64,
    /// Locked as long as it is open.
    _lock: File,
    /// Held while a setup is written: sessions may share it.
    setups: Mutex<()>,
}

impl StateFolder {
    /// Takes a folder for this server, and makes it if it is not there; its files may take so many bytes.
    ///
    /// # Errors
    /// If it cannot be made or written, belongs to another user, can be written by others, or another server uses it.
    pub(crate) fn open(path: &Path, most_bytes: u64) -> io::Result<Self> {
        make_folder(path)?;
        let metadata = fs::metadata(path)?;
        let refused = |message: &str| Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
        if metadata.uid() != geteuid().as_raw() {
            return refused("it belongs to another user");
        }
        if metadata.mode() & 0o022 != 0 {
            return refused("others can write in it: `chmod go-w` on it mends that");
        }
        let mut options = OpenOptions::new();
        let lock = options.read(true).write(true).create(true).truncate(false).mode(0o600);
        let lock = lock.open(path.join("lock"))?;
        lock.try_lock().map_err(|error| match error {
            fs::TryLockError::WouldBlock => {
                io::Error::new(io::ErrorKind::WouldBlock, "another server uses it")
            }
            fs::TryLockError::Error(error) => error,
        })?;
        for folder in [SETUPS, SESSIONS] {
            make_folder(&path.join(folder))?;
        }
        Ok(Self { path: path.to_owned(), most_bytes, _lock: lock, setups: Mutex::new(()) })
    }

    /// The file of its token.
    pub(crate) fn token_path(&self) -> PathBuf {
        self.path.join("token")
    }

    /// Writes its token, which this user alone can read.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn put_token(&self, token: &str) -> io::Result<()> {
        put(&self.token_path(), format!("{token}\n").as_bytes())
    }

    /// The folder of the session of a uid.
    pub(crate) fn session(self: &Arc<Self>, uid: &str) -> SessionFolder {
        SessionFolder { path: self.path.join(SESSIONS).join(uid), folder: Arc::clone(self) }
    }

    /// The uids of the sessions that have a state, in order; a session that was never written is forgotten.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub(crate) fn sessions(self: &Arc<Self>) -> io::Result<Vec<String>> {
        let mut uids = Vec::new();
        for uid in names(&self.path.join(SESSIONS))? {
            let session = self.session(&uid);
            match session.states() {
                Ok(states) if states.is_empty() => drop(session.forget_unwritten()),
                Ok(_) => uids.push(uid),
                // A file of somebody else.
                Err(_) => {}
            }
        }
        Ok(uids)
    }

    /// Removes the setups that no state names, and what was not written to its end. Where a state cannot tell its setup, it may need any
    /// of them: all stay.
    ///
    /// # Errors
    /// If the folder cannot be read or written.
    pub(crate) fn sweep(self: &Arc<Self>) -> io::Result<()> {
        let (mut needed, mut is_known) = (Vec::new(), true);
        for uid in self.sessions()? {
            let session = self.session(&uid);
            for place in session.states()? {
                match setup_of(&session.path, place) {
                    Ok((setup, _)) => needed.push(setup_name(setup)),
                    Err(_) => is_known = false,
                }
            }
            for name in names(&session.path)?.iter().filter(|name| is_unfinished_state(name)) {
                fs::remove_file(session.path.join(name))?;
            }
        }
        if !is_known {
            return Ok(());
        }
        let setups = self.path.join(SETUPS);
        let is_left = |name: &&String| !needed.contains(name) && is_setup(unfinished(name).unwrap_or(name));
        for name in names(&setups)?.iter().filter(is_left) {
            fs::remove_file(setups.join(name))?;
        }
        Ok(())
    }

    /// Refuses so many bytes more if all files would then take more than they may.
    fn check_room(&self, bytes: u64) -> io::Result<()> {
        let sessions = self.path.join(SESSIONS);
        let mut used = bytes_in(&self.path.join(SETUPS))?;
        for uid in names(&sessions)? {
            // It may be removed meanwhile.
            used += bytes_in(&sessions.join(uid)).unwrap_or_default();
        }
        if used.saturating_add(bytes) <= self.most_bytes {
            return Ok(());
        }
        let allowed = self.most_bytes;
        let message =
            format!("{bytes} bytes are needed beside {used}; allowed: {allowed} in all (--max-state-bytes)");
        Err(io::Error::new(io::ErrorKind::StorageFull, message))
    }

    fn setup_path(&self, setup: Digest) -> PathBuf {
        self.path.join(SETUPS).join(setup_name(setup))
    }

    /// Whether a setup is there, and unaltered.
    fn has_setup(&self, setup: Digest) -> bool {
        let found = File::open(self.setup_path(setup)).and_then(|mut file| digest_of(&mut file));
        found.is_ok_and(|found| found == setup)
    }
}

/// The folder of one session.
#[derive(Clone, Debug)]
pub(crate) struct SessionFolder {
    folder: Arc<StateFolder>,
    path: PathBuf,
}

impl SessionFolder {
    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Makes it, unless it is there.
    ///
    /// # Errors
    /// If it cannot be made.
    pub(crate) fn make(&self) -> io::Result<()> {
        make_folder(&self.path)
    }

    /// Writes a setup, unless it is there.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn put_setup(&self, section: &[u8]) -> io::Result<Digest> {
        let setup = Digest::of(section);
        // No code that holds the lock can leave something half changed.
        let _writing = self.folder.setups.lock().unwrap_or_else(PoisonError::into_inner);
        if !self.folder.has_setup(setup) {
            self.folder.check_room(setup.length)?;
            put(&self.folder.setup_path(setup), section)?;
        }
        Ok(setup)
    }

    /// Writes a state, without its setup, which is there.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn put_state(&self, place: StatePlace, bytes: &[u8]) -> io::Result<()> {
        self.folder.check_room(bytes.len() as u64)?;
        put(&self.path.join(place.name(STATE)), bytes)
    }

    /// A new, empty log.
    ///
    /// # Errors
    /// If it cannot be made.
    pub(crate) fn new_log(&self, place: StatePlace) -> io::Result<File> {
        let path = self.path.join(place.name(LOG));
        OpenOptions::new().append(true).create_new(true).mode(0o600).open(path)
    }

    /// The states that are there, the newest first.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub(crate) fn states(&self) -> io::Result<Vec<StatePlace>> {
        let mut places = places(&self.path, STATE)?;
        places.reverse();
        Ok(places)
    }

    /// The logs since a state, in order.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub(crate) fn logs_since(&self, state: StatePlace) -> io::Result<Vec<StatePlace>> {
        let mut places = places(&self.path, LOG)?;
        places.retain(|place| place.number >= state.number);
        Ok(places)
    }

    /// The highest number of a file, 0 if there is none.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub(crate) fn last_number(&self) -> io::Result<u64> {
        let places = [places(&self.path, STATE)?, places(&self.path, LOG)?].concat();
        Ok(places.iter().map(|place| place.number).max().unwrap_or_default())
    }

    /// Bytes of memory that a state takes when it is read, and the logs since.
    ///
    /// # Errors
    /// If the folder cannot be read, or the beginning of the state is damaged.
    pub(crate) fn bytes(&self, state: StatePlace) -> io::Result<u64> {
        let (setup, _) = setup_of(&self.path, state)?;
        let mut bytes = fs::metadata(self.path.join(state.name(STATE)))?.len().saturating_add(setup.length);
        for log in self.logs_since(state)? {
            bytes = bytes.saturating_add(fs::metadata(self.path.join(log.name(LOG)))?.len());
        }
        Ok(bytes)
    }

    /// A state as a whole file, with its setup.
    ///
    /// # Errors
    /// If it cannot be read, or its beginning is damaged; the rest was not checked yet.
    pub(crate) fn read_state(&self, place: StatePlace) -> io::Result<Vec<u8>> {
        whole(&self.path, &self.folder.path.join(SETUPS), place)
    }

    /// A log.
    ///
    /// # Errors
    /// If it cannot be read.
    pub(crate) fn read_log(&self, place: StatePlace) -> io::Result<Vec<u8>> {
        fs::read(self.path.join(place.name(LOG)))
    }

    /// Leaves so many bytes of a log: what follows them is damaged.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn cut_log(&self, place: StatePlace, length: u64) -> io::Result<()> {
        OpenOptions::new().write(true).open(self.path.join(place.name(LOG)))?.set_len(length)
    }

    /// Removes a log, and what follows from it.
    ///
    /// # Errors
    /// If the folder cannot be written.
    pub(crate) fn remove_log(&self, place: StatePlace) -> io::Result<()> {
        fs::remove_file(self.path.join(place.name(LOG)))
    }

    /// Gives a state that cannot be used another name: it stays, and counts no longer.
    ///
    /// # Errors
    /// If the folder cannot be written.
    pub(crate) fn set_aside(&self, place: StatePlace) -> io::Result<()> {
        fs::rename(self.path.join(place.name(STATE)), self.path.join(place.name("damaged")))
    }

    /// Removes all states but the newest two, and the logs before the older of them.
    ///
    /// # Errors
    /// If the folder cannot be read or written.
    pub(crate) fn forget_older(&self) -> io::Result<()> {
        let states = self.states()?;
        let Some(oldest) = states.get(KEPT_STATES - 1) else { return Ok(()) };
        for state in &states[KEPT_STATES..] {
            fs::remove_file(self.path.join(state.name(STATE)))?;
        }
        for log in places(&self.path, LOG)?.iter().filter(|log| log.number < oldest.number) {
            fs::remove_file(self.path.join(log.name(LOG)))?;
        }
        Ok(())
    }

    /// Removes the session with all its files.
    ///
    /// # Errors
    /// If the folder cannot be written.
    pub(crate) fn remove(&self) -> io::Result<()> {
        match fs::remove_dir_all(&self.path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            removed => removed,
        }
    }

    /// Removes the folder of a session of which no state was written: if it has no files but logs and unfinished states.
    fn forget_unwritten(&self) -> io::Result<()> {
        let is_own = |name: &String| is_unfinished_state(name) || StatePlace::of(name, LOG).is_some();
        if names(&self.path)?.iter().all(is_own) { self.remove() } else { Ok(()) }
    }
}

/// Whether a file is a state that was not written to its end.
fn is_unfinished_state(name: &str) -> bool {
    unfinished(name).is_some_and(|name| StatePlace::of(name, STATE).is_some())
}

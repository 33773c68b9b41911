//! The folder in which a server keeps its sessions.
//!
//! `lock` is held by the server that uses it. `token` is what its callers show. `setups` has the setups of worlds, each named after its
//! hash and its length. `sessions` has a folder for each session, named after its uid, with the newest two states, `state-NUMBER-STEP`,
//! each a file of a session without its setup, and the logs since, `log-NUMBER-STEP`. Every file but a log is renamed into place.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::{
        self,
        ErrorKind::{NotADirectory, NotFound},
    },
    os::unix::fs::{MetadataExt as _, OpenOptionsExt as _},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
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
/// Bytes of memory for each of a log that is read: a record takes more than there, and a list of them grows by doubling.
const LOG_SHARE: u64 = 8;
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
    /// The setup of each session that was told to write one, by its folder: one of which no state is there yet is needed, too. Held while
    /// a setup is written or removed: sessions may share it.
    setups: Mutex<BTreeMap<PathBuf, Digest>>,
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
        Ok(Self { path: path.to_owned(), most_bytes, _lock: lock, setups: Mutex::default() })
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

    /// Removes the setups that no state names, and what was not written to its end, before a session writes anything.
    ///
    /// # Errors
    /// If the folder cannot be read or written.
    pub(crate) fn sweep(self: &Arc<Self>) -> io::Result<()> {
        for uid in self.sessions()? {
            let session = self.session(&uid);
            for name in names(&session.path)?.iter().filter(|name| is_unfinished_state(name)) {
                fs::remove_file(session.path.join(name))?;
            }
        }
        self.sweep_setups(&self.lock())
    }

    /// Removes the setups that no state names and no session is about to name. Where a state cannot tell its setup, it may need any of
    /// them: all stay.
    fn sweep_setups(&self, about: &BTreeMap<PathBuf, Digest>) -> io::Result<()> {
        let mut needed: Vec<String> = about.values().copied().map(setup_name).collect();
        let sessions = self.path.join(SESSIONS);
        for uid in names(&sessions)? {
            let session = sessions.join(uid);
            let states = match places(&session, STATE) {
                Ok(states) => states,
                // It is a file of somebody else, or was removed meanwhile.
                Err(error) if matches!(error.kind(), NotADirectory | NotFound) => continue,
                Err(_) => return Ok(()),
            };
            for place in states {
                match setup_of(&session, place) {
                    Ok((setup, _)) => needed.push(setup_name(setup)),
                    Err(error) if error.kind() == NotFound => {}
                    Err(_) => return Ok(()),
                }
            }
        }
        let setups = self.path.join(SETUPS);
        let is_left = |name: &&String| !needed.contains(name) && is_setup(unfinished(name).unwrap_or(name));
        for name in names(&setups)?.iter().filter(is_left) {
            fs::remove_file(setups.join(name))?;
        }
        Ok(())
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<PathBuf, Digest>> {
        // No code that holds the lock can leave it half changed.
        self.setups.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Refuses so many bytes more if all files would then take more than they may, also without the setups that nobody needs.
    fn make_room(&self, bytes: u64, about: &BTreeMap<PathBuf, Digest>) -> io::Result<()> {
        self.check_room(bytes).or_else(|_full| {
            self.sweep_setups(about)?;
            self.check_room(bytes)
        })
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
        let mut about = self.folder.lock();
        // Where it is there already, it stays there.
        about.insert(self.path.clone(), setup);
        if !self.folder.has_setup(setup) {
            self.folder.make_room(setup.length, &about)?;
            put(&self.folder.setup_path(setup), section)?;
        }
        drop(about);
        // The folder of the session is there after a power cut, too.
        File::open(self.folder.path.join(SESSIONS))?.sync_all()?;
        Ok(setup)
    }

    /// Whether a setup that was written is still there.
    pub(crate) fn has_setup(&self, setup: Digest) -> bool {
        fs::metadata(self.folder.setup_path(setup)).is_ok_and(|metadata| metadata.len() == setup.length)
    }

    /// Writes a state, without its setup, which is there.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn put_state(&self, place: StatePlace, bytes: &[u8]) -> io::Result<()> {
        let about = self.folder.lock();
        self.folder.make_room(bytes.len() as u64, &about)?;
        drop(about);
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
            let length = fs::metadata(self.path.join(log.name(LOG)))?.len();
            bytes = bytes.saturating_add(length.saturating_mul(LOG_SHARE));
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

    /// A log of what calls changed since a state.
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
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            removed => removed?,
        }
        self.folder.lock().remove(&self.path);
        Ok(())
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

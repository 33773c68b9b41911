//! A run that goes on where it was cut off: what is kept of it in a folder, and when its next state is due.
//!
//! Enters: a scene with its options, and a session that stands. Leaves: the file of the newest state, written once all frames up to it
//! are. `DIR/runs/HASH` has of a run: `lock`, held while it is computed; `begun`, from before its first frame on; `state`, the file of
//! its session, as `nappe save` writes one; and `ended`, the steps that it took, once it has ended.

use std::{
    fs::{self, File, TryLockError},
    io,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use nappe_client::{Client, v1};
use xxhash_rust::xxh3::xxh3_64;

use super::progress::Progress;
use crate::{
    files::{
        paths,
        write::{self, Existing},
    },
    options::args::{ComputeArgs, JobArgs},
    scenes::scene::Input,
    words::{
        error::{CliError, Result},
        output,
    },
};

/// Seconds between two states, unless told otherwise.
const INTERVAL: f64 = 10.0;
/// Longer than any run (s).
const FOREVER: f64 = 1e9;
/// Seconds between two states for each second that keeping one takes: 2 % of the time at most.
const COST_SHARE: u32 = 50;

/// The folder of runs.
const RUNS: &str = "runs";
const LOCK: &str = "lock";
const BEGUN: &str = "begun";
const STATE: &str = "state";
const ENDED: &str = "ended";

/// A run that is kept.
#[derive(Debug)]
pub(super) struct Job {
    folder: PathBuf,
    /// Held until the run ends, however the program does.
    _lock: File,
    interval: Duration,
    /// When the next state is due.
    due: Instant,
    /// Whether the last state could not be kept, which was told.
    is_behind: bool,
    /// Whether it goes on from a state.
    goes_on: bool,
}

/// How far a run has come.
#[derive(Debug)]
pub(super) enum Found {
    /// Nothing of it is kept.
    Nothing,
    /// It was cut off before its first state; its frames are there.
    Begun,
    /// The file of its newest state.
    State(Vec<u8>),
    /// It has ended after so many steps.
    Ended(u64),
}

impl Job {
    /// Takes what is kept of a run of a scene with these options; none if it is not to be kept.
    ///
    /// # Errors
    /// When its frames go to a file, the same run is computed already, or the folder cannot be read or written.
    pub(super) fn open(
        args: &JobArgs,
        scene: &Input,
        compute: &ComputeArgs,
    ) -> Result<Option<(Self, Found)>> {
        let Some(kept) = &args.state_dir else { return Ok(None) };
        if let Some(save) = compute.save.as_deref().filter(|save| !paths::is_folder(save)) {
            return Err(CliError::usage(format!(
                "--save {}: a run that --state-dir keeps goes on in a folder of PLY files, and in no file",
                save.display()
            )));
        }
        let folder = kept.join(RUNS).join(name(scene, compute)?);
        fs::create_dir_all(&folder).map_err(|error| CliError::file("make the folder", &folder, &error))?;
        let lock = lock(&folder)?;
        let found = if args.fresh { Found::Nothing } else { find(&folder)? };
        let goes_on = matches!(found, Found::State(_));
        let interval =
            Duration::from_secs_f64(args.checkpoint_seconds.unwrap_or(INTERVAL).clamp(0.0, FOREVER));
        let due = Instant::now() + interval;
        Ok(Some((Self { folder, _lock: lock, interval, due, is_behind: false, goes_on }, found)))
    }

    /// Whether it goes on from a state.
    pub(super) fn goes_on(&self) -> bool {
        self.goes_on
    }

    /// How long it is until the next state is due.
    pub(super) fn wait(&self) -> Duration {
        self.due.saturating_duration_since(Instant::now())
    }

    /// Notes that a session of the run is there, whose frames come next. Of one that begins anew, the earlier state goes.
    ///
    /// # Errors
    /// When that cannot be written.
    pub(super) fn begin(&mut self) -> Result<()> {
        self.due = Instant::now() + self.interval;
        write::write_whole(&self.folder.join(BEGUN), b"", Existing::Overwritten)?;
        if self.goes_on {
            return Ok(());
        }
        remove(&self.folder.join(ENDED))?;
        remove(&self.folder.join(STATE))
    }

    /// Keeps a session as it stands, of which all frames were saved. Where that fails the run goes on, which is told once.
    pub(super) async fn keep(&mut self, client: &Client, session: &v1::Session, progress: &Progress) {
        let begin = Instant::now();
        match self.write(client, &session.session_id).await {
            Ok(()) => self.is_behind = false,
            Err(error) if !self.is_behind => {
                let step = output::count(session.step);
                progress.note(&format!(
                    "warning: the state at step {step} is not kept, and the next one is tried: {}",
                    error.message
                ));
                self.is_behind = true;
            }
            Err(_) => {}
        }
        let least = begin.elapsed().saturating_mul(COST_SHARE);
        self.due = Instant::now() + self.interval.max(least).min(Duration::from_secs_f64(FOREVER));
    }

    async fn write(&self, client: &Client, id: &str) -> Result<()> {
        let file = client.save(id).await?.whole().await?;
        write::write_whole(&self.folder.join(STATE), &file, Existing::Overwritten)
    }

    /// Notes that the run has ended after so many steps.
    ///
    /// # Errors
    /// When that cannot be written.
    pub(super) fn end(&self, step: u64) -> Result<()> {
        write::write_whole(&self.folder.join(ENDED), format!("{step}\n").as_bytes(), Existing::Overwritten)?;
        remove(&self.folder.join(STATE))
    }
}

/// What tells a run from others: the scene with its meshes, and all options that its states and the files of its frames depend on.
fn name(scene: &Input, compute: &ComputeArgs) -> Result<String> {
    let digest = scene.digest().ok_or_else(|| {
        CliError::failure(format!("the text of the scene '{}' is not known here", scene.name()))
    })?;
    let options = format!("{digest} {} {:?}", compute.overrides.of_states(), compute.fields);
    Ok(output::hash(xxh3_64(options.as_bytes())))
}

/// Takes the lock of a run.
fn lock(folder: &Path) -> Result<File> {
    let path = folder.join(LOCK);
    let opened = File::options().write(true).create(true).truncate(false).open(&path);
    let file = opened.map_err(|error| CliError::file("write", &path, &error))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            return Err(CliError::failure(format!(
                "this run is computed already: its state is in {}",
                folder.display()
            ))
            .hint("wait for its end, or name another folder with --state-dir"));
        }
        Err(TryLockError::Error(error)) => output::note(&format!(
            "{} cannot be locked ({error}): start this run no second time with the same --state-dir",
            path.display()
        )),
    }
    Ok(file)
}

/// What is kept of a run.
fn find(folder: &Path) -> Result<Found> {
    let ended = folder.join(ENDED);
    if let Some(text) = read(&ended)? {
        let steps = String::from_utf8_lossy(&text).trim().parse::<u64>();
        return steps.map(Found::Ended).map_err(|error| {
            CliError::failure(format!("{} says no number of steps: {error}", ended.display()))
                .hint("--fresh begins the run anew")
        });
    }
    if let Some(state) = read(&folder.join(STATE))? {
        return Ok(Found::State(state));
    }
    Ok(if folder.join(BEGUN).is_file() { Found::Begun } else { Found::Nothing })
}

/// A file, if it is there.
fn read(path: &Path) -> Result<Option<Vec<u8>>> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(CliError::file("read", path, &error)),
    }
}

/// Removes a file, if it is there.
fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(CliError::file("remove", path, &error)),
        _ => Ok(()),
    }
}

//! A client that saves every frame of a session while its server is killed and comes back: none is missing, and none comes twice.
//!
//! Enters: a session that will end. Leaves: how many frames there were, or which one is missing. A file that is there already would end
//! the command, so that no frame can come twice.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process::{Child, Stdio},
};

use super::server::{Caller, until};
use crate::shell::Failure;

/// The exit code where no server answers.
const NO_SERVER: i32 = 4;

/// What was saved since a watcher began.
struct Part {
    folder: PathBuf,
    /// The frame that it has to begin with; none: the newest one at its time.
    from: Option<u64>,
}

/// The command that watches, and what it saved.
pub(super) struct Watched {
    process: Child,
    caller: Caller,
    id: String,
    /// Where its folders are.
    place: PathBuf,
    parts: Vec<Part>,
}

impl Watched {
    /// Begins to watch a session from its first frame.
    pub(super) fn begin(caller: &Caller, id: &str, place: &Path) -> Result<Self, Failure> {
        let part = Part { folder: place.join(format!("{id}-0")), from: Some(0) };
        let process = watch(caller, id, &part)?;
        let (caller, id, place) = (caller.clone(), id.to_owned(), place.to_owned());
        Ok(Self { process, caller, id, place, parts: vec![part] })
    }

    /// Begins anew where the watcher gave up: with the frame after its last if no server had answered for too long, and with the newest
    /// if the server had forgotten that one, as it may forget frames before its newest state.
    pub(super) fn look(&mut self) -> Result<(), Failure> {
        let ended = self.process.try_wait().map_err(|error| Failure(format!("nappe watch: {error}")))?;
        let (Some(status), Some(part)) = (ended, self.parts.last()) else { return Ok(()) };
        let said = fs::read_to_string(said(&part.folder)).unwrap_or_default();
        let from = if said.contains("FRAME_EXPIRED") {
            None
        } else if status.code() == Some(NO_SERVER) {
            let last = frames(&part.folder)?.last().copied();
            last.map(|last| last + 1).or(part.from)
        } else {
            return Err(Failure(format!("the watcher of {} ended: {}", self.id, said.trim())));
        };
        let part = Part { folder: self.place.join(format!("{}-{}", self.id, self.parts.len())), from };
        self.process = watch(&self.caller, &self.id, &part)?;
        self.parts.push(part);
        Ok(())
    }

    /// Waits for the end of a session that has ended with this frame: how many frames came, and how often the next one was forgotten.
    pub(super) fn end(mut self, last_frame: u64) -> Result<(u64, usize), Failure> {
        let mut status = None;
        until("the watcher ends with its session", || {
            status = self.process.try_wait().map_err(|error| Failure(format!("nappe watch: {error}")))?;
            Ok(status.is_some())
        })?;
        if !status.is_some_and(|status| status.success()) {
            return Err(Failure(format!("the watcher of {} did not see its end", self.id)));
        }
        let (mut count, mut last) = (0, None);
        for part in &self.parts {
            let frames = frames(&part.folder)?;
            self.check(part, &frames, last)?;
            count += frames.len() as u64;
            last = frames.last().copied().or(last);
        }
        if last != Some(last_frame) {
            return Err(Failure(format!("{}: the last frame is {last:?}, not {last_frame}", self.id)));
        }
        Ok((count, self.parts.iter().filter(|part| part.from.is_none()).count()))
    }

    /// Checks that the frames of a part follow each other, and those before, of which this was the last.
    fn check(&self, part: &Part, frames: &[u64], last: Option<u64>) -> Result<(), Failure> {
        let Some(first) = frames.first() else { return Ok(()) };
        if part.from.is_some_and(|from| from != *first) || last.is_some_and(|last| *first <= last) {
            return Err(Failure(format!("{}: frame {first} comes after frame {last:?}", self.id)));
        }
        match frames.windows(2).find(|pair| pair[1] != pair[0] + 1) {
            Some(pair) => {
                Err(Failure(format!("{}: frame {} comes after frame {}", self.id, pair[1], pair[0])))
            }
            None => Ok(()),
        }
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Starts the command, which saves frames in a folder, and says what it has to say in a file beside it.
fn watch(caller: &Caller, id: &str, part: &Part) -> Result<Child, Failure> {
    let said = said(&part.folder);
    let log = File::create(&said).map_err(|error| Failure(format!("{}: {error}", said.display())))?;
    let mut command = caller.command(&["watch", id, "--save"]);
    command.arg(&part.folder).stdout(Stdio::null()).stderr(log);
    if let Some(from) = part.from {
        command.args(["--from", &from.to_string()]);
    }
    command.spawn().map_err(|error| Failure(format!("nappe watch: {error}")))
}

/// The file of what a watcher says.
fn said(folder: &Path) -> PathBuf {
    folder.with_extension("said")
}

/// The numbers of the frames in a folder, in order.
fn frames(folder: &Path) -> Result<Vec<u64>, Failure> {
    let entries = fs::read_dir(folder).map_err(|error| Failure(format!("{}: {error}", folder.display())))?;
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let number = |name: String| name.strip_prefix("frame-")?.strip_suffix(".ply")?.parse().ok();
    let mut frames: Vec<u64> = names.filter_map(number).collect();
    frames.sort_unstable();
    Ok(frames)
}

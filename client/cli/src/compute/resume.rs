//! Going on in a folder of saved frames as the run that was saved there: from its last whole frame.
//!
//! Enters: a folder, and the scene of the run. Leaves: the frame and what comes after it, or that the run has ended; the command line that
//! goes on where this one is ended.

use std::path::{Path, PathBuf};

use super::start::{SavedFrame, frames};
use crate::{
    files::frame_notes::FrameNotes,
    save::Reached,
    scenes::scene::Input,
    words::{
        error::{CliError, Result},
        output,
    },
};

/// Options that one to go on in a folder takes the place of: with a value, and without.
const REPLACED: [(&str, Value); 4] = [
    ("--save", Value::Follows),
    ("--start", Value::Follows),
    ("--resume", Value::Follows),
    ("--force", Value::None),
];

/// Whether an option has a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Value {
    Follows,
    None,
}

/// A run that was saved in a folder.
#[derive(Debug)]
pub(super) struct Resumed {
    pub(super) frame: SavedFrame,
    pub(super) reached: Reached,
}

impl Resumed {
    /// Finds the last whole frame of a folder, and checks that it is one of this scene.
    ///
    /// # Errors
    /// When there is none, frames are of several runs, or do not say of which scene they are; when that is another one.
    pub(super) fn find(folder: &Path, scene: &Input) -> Result<Self> {
        let all = frames(folder)?;
        check_alike(folder, &all)?;
        let (number, frame) = last_whole(folder, all)?;
        let name = frame.file.display().to_string();
        let (Some(step), Some(saved)) = (frame.notes.step, frame.notes.scene.clone()) else {
            return Err(CliError::failure(format!("{name} does not say of which scene it is"))
                .hint("--start begins with it, and --save says where"));
        };
        if scene.digest().is_some_and(|own| own != saved) {
            return Err(CliError::failure(format!(
                "the scene {} is another one than when {name} was saved, and a run goes on in one scene",
                scene.name()
            ))
            .hint(format!("--start {name} begins there in the scene as it is now, and --save says where")));
        }
        Ok(Self { frame, reached: Reached { frame: number, step, scene: saved } })
    }

    /// Whether the run has ended that is to take so many steps (0: it has no end).
    pub(super) fn has_ended(&self, step_limit: u64) -> bool {
        step_limit > 0 && self.reached.step >= step_limit
    }
}

/// Refuses frames of several runs, which are of other scenes, in other precisions, or do not follow each other: which one is to go
/// on is not known.
fn check_alike(folder: &Path, all: &[(u64, PathBuf)]) -> Result<()> {
    let mut before: Option<(&PathBuf, FrameNotes)> = None;
    for (_, file) in all {
        let notes = FrameNotes::of_file(file).map_err(|error| CliError::file("read", file, &error))?;
        // One that was cut off within its header says too little.
        if notes.properties.is_empty() {
            continue;
        }
        let is_other = |earlier: &FrameNotes| {
            (&earlier.scene, earlier.precision) != (&notes.scene, notes.precision)
                || earlier.step >= notes.step
        };
        if let Some((earlier, _)) = before.as_ref().filter(|(_, earlier)| is_other(earlier)) {
            let name = |file: &Path| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            return Err(CliError::failure(format!(
                "the folder {} holds frames of two runs ({} and {}): which one is to go on is not known",
                folder.display(),
                name(earlier),
                name(file)
            ))
            .hint("--start FILE.ply begins with a frame, and --save says where"));
        }
        before = Some((file, notes));
    }
    Ok(())
}

/// The last frame that is whole, with its number; tells of those after it that are not.
fn last_whole(folder: &Path, all: Vec<(u64, PathBuf)>) -> Result<(u64, SavedFrame)> {
    let mut first_error = None;
    for (number, file) in all.into_iter().rev() {
        let error = match SavedFrame::of_file(file) {
            Ok(frame) => return Ok((number, frame)),
            // With a remedy it is not cut off.
            Err(error) if error.hint.is_some() => return Err(error),
            Err(error) => error,
        };
        output::note(&format!("warning: a frame is left out that cannot be read: {}", error.message));
        first_error = first_error.or(Some(error));
    }
    Err(first_error.unwrap_or_else(|| {
        CliError::failure(format!("the folder {} holds no frame (frame-000000.ply)", folder.display()))
    }))
}

/// This command line, as one that goes on in a folder where this one is ended.
pub(super) fn again(folder: &Path) -> String {
    let words = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned());
    line(words, &folder.display().to_string())
}

fn line(words: impl Iterator<Item = String>, folder: &str) -> String {
    let (mut kept, mut is_value) = (vec!["nappe".to_owned()], false);
    for word in words {
        if std::mem::take(&mut is_value) {
            continue;
        }
        let (name, value) =
            word.split_once('=').map_or((word.as_str(), None), |(name, value)| (name, Some(value)));
        match REPLACED.iter().find(|(replaced, _)| *replaced == name) {
            Some((_, kind)) => is_value = *kind == Value::Follows && value.is_none(),
            None => kept.push(quoted(&word)),
        }
    }
    kept.extend(["--resume".to_owned(), quoted(folder)]);
    kept.join(" ")
}

/// A word as a shell reads it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_goes_on_in_the_folder_with_all_that_was_asked_for() {
        for (typed, expected) in [
            ("run flag --save frames --steps 9", "nappe run flag --steps 9 --resume frames"),
            (
                "run --save=frames flag --force --fields velocity",
                "nappe run flag --fields velocity --resume frames",
            ),
            ("run flag --start old/frame-000003.ply --save frames", "nappe run flag --resume frames"),
            ("run flag --resume frames --json", "nappe run flag --json --resume frames"),
        ] {
            let words = typed.split(' ').map(str::to_owned);
            assert_eq!(line(words, "frames"), expected, "{typed}");
        }
        let words = ["run", "a scene.toml", "--save", "it's"].map(str::to_owned).into_iter();
        assert_eq!(line(words, "it's"), r"nappe run 'a scene.toml' --resume 'it'\''s'");
    }
}

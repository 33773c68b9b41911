//! A film: which frames it shows and when, and ffmpeg, which makes it of their pictures.
//!
//! Enters: times of frames (s), pictures as PNG. Leaves: a file of MP4.

use std::{
    io,
    path::{Path, PathBuf},
    process::Stdio,
    time::Duration,
};

use tokio::{
    io::AsyncWriteExt as _,
    process::{Child, ChildStdin, Command},
    time::timeout,
};

use super::scratch::{FFMPEG, Scratch, last_lines};
use crate::words::error::{CliError, Result};

/// Most pictures per second: where there are more frames, the nearest ones are shown.
const MOST_RATE: f64 = 60.0;
/// Pictures per second of a film of one picture.
const ONE_RATE: f64 = 25.0;
/// A part of the time between two pictures that times may be off by rounding.
const ROUNDING: f64 = 1e-6;

/// What a film shows: it plays as fast as what was simulated.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cut {
    /// Pictures per second.
    pub(super) rate: f64,
    /// The frame of each picture.
    pub(super) frames: Vec<usize>,
}

impl Cut {
    /// The film of frames at these times (s).
    pub(super) fn of(times: &[f64]) -> Self {
        let (first, last) =
            (times.first().copied().unwrap_or_default(), times.last().copied().unwrap_or_default());
        let rate = (times.len() as f64 - 1.0) / (last - first);
        if !rate.is_finite() || rate <= 0.0 {
            return Self { rate: ONE_RATE, frames: (0..times.len()).collect() };
        }
        if rate <= MOST_RATE {
            return Self { rate, frames: (0..times.len()).collect() };
        }
        let count = ((last - first) * MOST_RATE + ROUNDING).floor() as usize + 1;
        let frames = (0..count).map(|picture| nearest(times, first + picture as f64 / MOST_RATE)).collect();
        Self { rate: MOST_RATE, frames }
    }
}

/// The frame whose time is nearest, of times that do not fall; the first of none.
pub(super) fn nearest(times: &[f64], time: f64) -> usize {
    let after = times.partition_point(|known| *known < time);
    let Some(before) = after.checked_sub(1) else { return 0 };
    match times.get(after) {
        Some(next) if next - time < time - times[before] => after,
        _ => before,
    }
}

/// ffmpeg, while it makes a film.
pub(super) struct Film {
    program: PathBuf,
    log: PathBuf,
    process: Child,
    /// Pictures, one after the other.
    input: ChildStdin,
    patience: Duration,
}

impl Film {
    /// Starts a film of so many pictures per second, which may each take so long.
    ///
    /// # Errors
    /// When the system does not start the program.
    pub(super) fn start(program: &Path, rate: f64, scratch: &Scratch, patience: Duration) -> Result<Self> {
        let (said, log) = scratch.log(FFMPEG)?;
        let mut command = Command::new(program);
        command.args(["-hide_banner", "-loglevel", "error", "-y", "-f", "image2pipe", "-c:v", "png"]);
        command.args(["-framerate", &rate.to_string(), "-i", "-", "-an"]);
        // The colours that every player knows, and the index at the beginning, for pages.
        command.args(["-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"]).arg(scratch.film());
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(said).kill_on_drop(true);
        // Ctrl-C reaches it through this command alone.
        #[cfg(unix)]
        command.process_group(0);
        let failed =
            |error: &io::Error| CliError::failure(format!("cannot start {}: {error}", program.display()));
        let mut process = command.spawn().map_err(|error| failed(&error))?;
        let Some(input) = process.stdin.take() else {
            return Err(failed(&io::Error::other("it has no pipe")));
        };
        Ok(Self { program: program.to_owned(), log, process, input, patience })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// When the program ends or hangs, with what it said last.
    pub(super) async fn add(&mut self, png: &[u8]) -> Result<()> {
        match timeout(self.patience, self.input.write_all(png)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_closed)) => Err(self.failed("before the last picture").await),
            Err(_elapsed) => Err(self.silent("takes no picture")),
        }
    }

    /// Ends the film and waits for it.
    ///
    /// # Errors
    /// As [`Self::add`], and when the program says that it failed.
    pub(super) async fn finish(self) -> Result<()> {
        let Self { program, log, mut process, input, patience } = self;
        // That was the last picture.
        drop(input);
        let how = match timeout(patience, process.wait()).await {
            Ok(Ok(status)) if status.success() => return Ok(()),
            Ok(Ok(status)) => format!("made no film ({status})"),
            Ok(Err(error)) => format!("cannot be waited for: {error}"),
            Err(_elapsed) => format!("does not end within {} s", patience.as_secs_f64()),
        };
        // It may have ended already.
        let _ = process.kill().await;
        Err(CliError::failure(format!("{} {how}{}", program.display(), last_lines(&log))))
    }

    /// It closed its pipe.
    async fn failed(&mut self, when: &str) -> CliError {
        let how = match timeout(self.patience, self.process.wait()).await {
            Ok(Ok(status)) => format!("ended {when} ({status})"),
            _ => format!("closed its pipe {when}"),
        };
        CliError::failure(format!("{} {how}{}", self.program.display(), last_lines(&self.log)))
    }

    fn silent(&self, what: &str) -> CliError {
        let (program, seconds) = (self.program.display(), self.patience.as_secs_f64());
        CliError::failure(format!("{program} {what} within {seconds} s{}", last_lines(&self.log)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_plays_as_fast_as_what_was_simulated() {
        let times =
            |count: u32, apart: f64| (0..count).map(|k| 0.5 + apart * f64::from(k)).collect::<Vec<_>>();
        let cut = Cut::of(&times(11, 0.04));
        assert!((cut.rate - 25.0).abs() < 1e-9 && cut.frames == (0..11).collect::<Vec<_>>(), "{cut:?}");
        // 240 frames per second: every fourth is shown, the last of them too.
        let cut = Cut::of(&times(25, 1.0 / 240.0));
        assert_eq!(cut, Cut { rate: 60.0, frames: vec![0, 4, 8, 12, 16, 20, 24] });
        assert_eq!(Cut::of(&[3.0]), Cut { rate: ONE_RATE, frames: vec![0] });
        assert_eq!(Cut::of(&[3.0, 3.0]).frames, [0, 1]);
        assert!(Cut::of(&[]).frames.is_empty());
    }

    #[test]
    fn the_frame_of_a_time_is_the_nearest() {
        let times = [0.0, 0.1, 0.3];
        let found = [-1.0, 0.0, 0.04, 0.06, 0.1, 0.19, 0.21, 0.3, 9.0].map(|time| nearest(&times, time));
        assert_eq!(found, [0, 0, 0, 1, 1, 1, 2, 2, 2]);
        assert_eq!(nearest(&[], 1.0), 0);
    }
}

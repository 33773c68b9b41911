//! Frames of points: what one is, which is the last one, and how many may be kept.

use std::path::Path;

use nappe_scene::files::ReadOptions;

use crate::words::error::{CliError, Result};

/// Places of all points in one frame (m).
pub(super) type Frame = Vec<[f32; 3]>;

/// What follows the last frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    /// Itself: it shows the end.
    Held,
    /// The first one, so that a frame at the end, which would show the same, is left out.
    Looped,
}

/// Refuses more than a file of frames may hold.
///
/// # Errors
/// When they take more bytes than a file that is read may have.
pub(super) fn check_size(path: &Path, points: usize, frames: usize) -> Result<()> {
    let most = ReadOptions::default().max_bytes;
    let bytes = (points.max(1) as u64).saturating_mul(frames as u64).saturating_mul(12);
    if bytes <= most {
        return Ok(());
    }
    Err(CliError::failure(format!(
        "{}: {frames} frames of {points} points take {bytes} bytes; allowed: at most {most}",
        path.display()
    )))
}

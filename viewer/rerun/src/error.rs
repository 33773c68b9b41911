//! Errors of the Rerun side.
//!
//! Enters: what the SDK met. Leaves: [`RerunError`], which says what a person can do about it.

use std::path::PathBuf;

use crate::sdk::{DEFAULT_CONNECT_URL, RecordingStreamError};

/// How to install the viewer that fits this SDK.
pub const INSTALL_HINT: &str = "install it with `pip install rerun-sdk==0.36.3`, or with \
                                `cargo install rerun-cli --locked --version 0.36.3`; or save a recording instead";

/// Why frames could not be recorded or shown.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of each variant says what its fields are")]
pub enum RerunError {
    /// There is no `rerun` command.
    #[error("the Rerun viewer was not found: no command `rerun` in PATH ({INSTALL_HINT})")]
    ViewerNotFound,
    /// The viewer did not start.
    #[error("the Rerun viewer did not start: {cause} (it needs a display; {INSTALL_HINT})")]
    ViewerFailed { cause: String },
    /// Nothing answers at the address of a viewer.
    #[error("no Rerun viewer answers at {url}: {cause} (expected, for example, {})", DEFAULT_CONNECT_URL)]
    Connect { url: String, cause: String },
    /// The recording file cannot be written.
    #[error("the recording {} is not complete: {cause}", path.display())]
    File { path: PathBuf, cause: String },
    /// Another recording writes the file.
    #[error("the recording {} is being written already, by another program or another run: give another name", path.display())]
    InUse { path: PathBuf },
    /// The SDK refused data.
    #[error("Rerun refused {what}: {source}")]
    Log { what: String, source: Box<RecordingStreamError> },
    /// A frame before any topology, or of another size.
    #[error("frame {frame} has {found} particles; the topology has {expected}")]
    Frame { frame: u64, found: usize, expected: usize },
    /// A position that is infinite or not a number.
    #[error("frame {frame}: the position of particle {particle} is not finite")]
    NotFinite { frame: u64, particle: usize },
    /// The viewer does not take data.
    #[error("the Rerun viewer has not taken the last frames within {seconds} s")]
    Stalled {
        /// How long was waited (s).
        seconds: f64,
    },
    /// The recording thread could not be started, or died.
    #[error("the recording thread failed: {cause}")]
    Thread { cause: String },
}

/// Names what was logged when the SDK refuses it.
pub(crate) fn refused(what: &str) -> impl FnOnce(RecordingStreamError) -> RerunError + '_ {
    move |source| RerunError::Log { what: what.to_owned(), source: Box::new(source) }
}

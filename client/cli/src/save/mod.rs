//! Where frames are kept: a Rerun recording, or a folder with PLY files.
//!
//! Reads topology and frames as they arrive; writes files. Every frame that comes is kept.

mod folder;
mod recording;

use std::path::{Path, PathBuf};

use nappe_client::{Frame, Topology, WatchOptions, v1};

use self::{folder::Folder, recording::Recording};
use crate::{error::Result, fields::FieldsArgs, paths};

/// Whether this build can write Rerun recordings.
pub(crate) const RECORDS: bool = cfg!(feature = "rerun");

/// An open recording or folder.
pub(crate) struct Sink {
    path: PathBuf,
    fields: FieldsArgs,
    form: Form,
}

enum Form {
    Folder(Folder),
    Recording(Recording),
}

impl Sink {
    /// Opens a recording for a path that ends in `.rrd`, a folder for another.
    ///
    /// # Errors
    /// When the path names neither, or a recording in a build without Rerun; when the file or the folder cannot be made, or the folder holds frames already.
    pub(crate) fn create(path: &Path, fields: &FieldsArgs) -> Result<Self> {
        paths::check_save(path)?;
        let form = if paths::is_recording(path) {
            Form::Recording(Recording::create(path, fields.recording_color())?)
        } else {
            Form::Folder(Folder::create(path)?)
        };
        Ok(Self { path: path.to_owned(), fields: fields.clone(), form })
    }

    /// These watch options with what is kept of a session's frames.
    pub(crate) fn watch(&self, options: WatchOptions, session: &v1::Session) -> WatchOptions {
        self.fields.watch(options, session, &self.path)
    }

    /// Keeps the topology; it comes before the frames.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn topology(&mut self, topology: Topology) -> Result<()> {
        match &mut self.form {
            Form::Folder(folder) => {
                folder.topology(topology);
                Ok(())
            }
            Form::Recording(recording) => recording.topology(&topology),
        }
    }

    /// Keeps a frame.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn frame(&mut self, frame: &Frame) -> Result<()> {
        match &mut self.form {
            Form::Folder(folder) => folder.write(frame),
            Form::Recording(recording) => recording.frame(frame),
        }
    }

    /// Closes it and gives its path.
    ///
    /// # Errors
    /// When its end cannot be written.
    pub(crate) fn finish(self) -> Result<PathBuf> {
        match self.form {
            Form::Folder(_) => {}
            Form::Recording(recording) => recording.finish()?,
        }
        Ok(self.path)
    }
}

//! Where frames are kept: a Rerun recording, or a folder with PLY files.
//!
//! Every frame that comes is kept. A folder is written here; a recording by `nappe-viewer`, which this command starts.

mod folder;
mod recording;

use std::path::{Path, PathBuf};

pub(crate) use self::{folder::Folder, recording::Recording};
use crate::{error::Result, fields::FieldsArgs, paths};

/// Where the frames of a session go.
pub(crate) struct Destination {
    /// The file or the folder.
    pub(crate) path: PathBuf,
    /// Who writes it.
    pub(crate) form: Form,
}

/// Who writes frames.
pub(crate) enum Form {
    /// This command, PLY files.
    Folder(Folder),
    /// `nappe-viewer`, a recording.
    Recording(Recording),
}

impl Destination {
    /// A recording for a path that ends in `.rrd`, a folder for another.
    ///
    /// # Errors
    /// When the path names neither; when there is no viewer to record, the folder cannot be made, or holds frames already.
    pub(crate) async fn open(path: &Path, fields: &FieldsArgs) -> Result<Self> {
        paths::check_save(path)?;
        let form = if paths::is_recording(path) {
            Form::Recording(Recording::prepare(fields).await?)
        } else {
            Form::Folder(Folder::create(path, fields)?)
        };
        Ok(Self { path: path.to_owned(), form })
    }
}

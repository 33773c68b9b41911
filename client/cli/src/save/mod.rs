//! Where frames are kept: an HTML file, a folder with PLY files, or a Rerun recording.
//!
//! Every frame that comes is kept. The first two are written here; a recording by `nappe-viewer`, which this command
//! starts.

mod surfaces;
mod folder;
mod html;
mod recording;

use std::path::{Path, PathBuf};

use nappe_client::{Frame, SessionEnd, Topology, WatchOptions, v1};

use self::{folder::Folder, html::Html};
pub(crate) use self::{
    folder::Reached,
    recording::{File, Recording},
};
use crate::{error::Result, fields::FieldsArgs, paths, scene::Input, write::Existing};

/// Where the frames of a session go.
pub(crate) struct Destination {
    /// The file or the folder.
    pub(crate) path: PathBuf,
    /// Who writes it.
    pub(crate) form: Form,
}

/// Who writes frames.
pub(crate) enum Form {
    /// This command, as the frames come.
    Sink(Sink),
    /// `nappe-viewer`, a recording.
    Recording(Recording),
}

/// What this command writes.
pub(crate) enum Sink {
    /// One PLY file per frame.
    Folder(Box<Folder>),
    /// One page that holds its frames.
    Html(Box<Html>),
}

impl Destination {
    /// An HTML file or a recording for a path that ends so, a folder for another; of a scene, if it is at hand.
    ///
    /// # Errors
    /// When the path names none of them; when there is no viewer to record, the file or the folder cannot be made, or
    /// a file or frames that are there stay.
    pub(crate) async fn open(
        path: &Path,
        existing: Existing,
        fields: &FieldsArgs,
        scene: Option<&Input>,
    ) -> Result<Self> {
        paths::check_save(path)?;
        let form = if paths::is_recording(path) {
            Form::Recording(Recording::prepare(path, existing, fields).await?)
        } else if paths::is_html(path) {
            let text = scene.and_then(Input::text);
            Form::Sink(Sink::Html(Box::new(Html::create(path, existing, fields, text)?)))
        } else {
            let digest = scene.and_then(Input::digest);
            Form::Sink(Sink::Folder(Box::new(Folder::create(path, existing, fields, digest)?)))
        };
        Ok(Self { path: path.to_owned(), form })
    }

    /// A folder in which a run goes on that was saved there.
    pub(crate) fn going_on(path: &Path, fields: &FieldsArgs, reached: Reached) -> Self {
        let sink = Sink::Folder(Box::new(Folder::going_on(path, fields, reached)));
        Self { path: path.to_owned(), form: Form::Sink(sink) }
    }

    /// The folder, if a run can go on from its frames.
    pub(crate) fn resumable(&self) -> Option<&Path> {
        match &self.form {
            Form::Sink(Sink::Folder(folder)) if folder.is_resumable() => Some(self.path.as_path()),
            _ => None,
        }
    }

    /// Closes what this command writes, with how the session ended or why it failed, if it did.
    ///
    /// # Errors
    /// When its end cannot be written.
    pub(crate) fn finish(self, end: Option<SessionEnd>, failure: Option<&v1::Failure>) -> Result<PathBuf> {
        if let Form::Sink(sink) = self.form {
            sink.finish(end, failure)?;
        }
        Ok(self.path)
    }
}

impl Sink {
    /// These watch options with what is kept of a session's frames.
    pub(crate) fn watch(&mut self, options: WatchOptions, session: &v1::Session) -> WatchOptions {
        match self {
            Self::Folder(folder) => folder.watch(options, session),
            Self::Html(html) => html.watch(options, session),
        }
    }

    /// Keeps the topology; it comes before the frames.
    pub(crate) fn topology(&mut self, topology: Topology) {
        match self {
            Self::Folder(folder) => folder.topology(topology),
            Self::Html(html) => html.topology(topology),
        }
    }

    /// Keeps a frame.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn frame(&mut self, frame: &Frame) -> Result<()> {
        match self {
            Self::Folder(folder) => folder.write(frame),
            Self::Html(html) => html.frame(frame),
        }
    }

    /// Closes it, with how the session ended or why it failed, if it did.
    ///
    /// # Errors
    /// When its end cannot be written.
    pub(crate) fn finish(self, end: Option<SessionEnd>, failure: Option<&v1::Failure>) -> Result<()> {
        match self {
            Self::Folder(folder) => folder.finish(),
            Self::Html(html) => html.finish(end, failure),
        }
    }
}

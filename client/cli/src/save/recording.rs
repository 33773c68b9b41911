//! A Rerun recording: `nappe-viewer` makes it, from the session's frames.

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

use crate::{
    files::{aside::Aside, write::Existing},
    options::fields::FieldsArgs,
    outside::viewer::{self, Child, Failure, Form, Place, Shown, Viewer},
    words::error::{CliError, Result},
};

/// A recording that can be made.
#[derive(Debug)]
pub(crate) struct Recording {
    viewer: Viewer,
    fields: FieldsArgs,
    file: File,
}

/// The file of a recording, which a viewer writes beside its name.
#[derive(Debug)]
pub(crate) struct File {
    path: PathBuf,
    /// None for a device or a pipe.
    aside: Option<Aside>,
}

impl File {
    /// Makes room for it.
    ///
    /// # Errors
    /// A file that is there and stays, and one that another run is writing.
    pub(crate) fn open(path: &Path, existing: Existing) -> Result<Self> {
        Ok(Self { path: path.to_owned(), aside: Aside::of(path, existing)? })
    }

    /// Where a viewer writes it.
    pub(crate) fn place(&self) -> &Path {
        self.aside.as_ref().map_or(self.path.as_path(), Aside::file)
    }

    /// Gives it its name, now that its viewer has ended so: one that did not fail closed it, and so did one that only the
    /// server refused.
    ///
    /// # Errors
    /// When it cannot have the name.
    pub(crate) fn keep(&self, ended: &std::result::Result<Shown, Failure>) -> Result<()> {
        let is_closed = match ended {
            Ok(_) => true,
            Err(failure) => failure.reason.is_some(),
        };
        match &self.aside {
            Some(aside) if is_closed => aside.keep(),
            _ => Ok(()),
        }
    }

    /// An error of who makes it, with where the file is if it is not at its place.
    pub(crate) fn told(&self, error: CliError) -> CliError {
        match &self.aside {
            Some(aside) => aside.told(error),
            None => error,
        }
    }
}

impl Recording {
    /// Finds who makes it, and makes room for its file.
    pub(super) async fn prepare(path: &Path, existing: Existing, fields: &FieldsArgs) -> Result<Self> {
        let file = File::open(path, existing)?;
        Ok(Self { viewer: Viewer::find().await?, fields: fields.clone(), file })
    }

    /// The file that it is written into.
    pub(crate) fn file(&self) -> &File {
        &self.file
    }

    /// Starts the recording of a session, with these options besides.
    ///
    /// # Errors
    /// When the system does not start the viewer.
    pub(crate) async fn start(
        &self,
        place: &Place,
        session_id: &str,
        options: impl IntoIterator<Item = OsString>,
    ) -> Result<Child> {
        let mut all = viewer::recording(session_id, &self.file.path, self.file.place());
        all.extend(self.fields.viewer_options());
        all.extend(options);
        self.viewer.start(place, all, Form::Recording).await
    }
}

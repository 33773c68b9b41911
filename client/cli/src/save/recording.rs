//! A Rerun recording: `nappe-viewer` makes it, from the session's frames.

use std::{ffi::OsString, path::Path};

use crate::{
    error::Result,
    fields::FieldsArgs,
    viewer::{self, Child, Form, Place, Viewer},
};

/// A recording that can be made.
#[derive(Debug)]
pub(crate) struct Recording {
    viewer: Viewer,
    fields: FieldsArgs,
}

impl Recording {
    /// Finds who makes it.
    pub(super) async fn prepare(fields: &FieldsArgs) -> Result<Self> {
        Ok(Self { viewer: Viewer::find().await?, fields: fields.clone() })
    }

    /// Starts the recording of a session in a file, with these options besides.
    ///
    /// # Errors
    /// When the system does not start the viewer.
    pub(crate) async fn start(
        &self,
        place: &Place,
        session_id: &str,
        path: &Path,
        options: impl IntoIterator<Item = OsString>,
    ) -> Result<Child> {
        let mut all = viewer::recording(session_id, path);
        all.extend(self.fields.viewer_options());
        all.extend(options);
        self.viewer.start(place, all, Form::Recording).await
    }
}

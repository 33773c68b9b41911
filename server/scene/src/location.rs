//! Where snow stands in its scene, for messages.

use crate::{
    error::{Fault, SceneError},
    source::{Path, Source},
};

/// A part of a scene and its text.
pub(crate) struct Place<'a> {
    pub(crate) path: Path,
    pub(crate) source: &'a Source,
}

impl Place<'_> {
    /// A fault in a field of this part.
    pub(crate) fn error(&self, fault: Fault, field: &str, message: impl Into<String>) -> SceneError {
        let path = field.split('.').fold(self.path.clone(), |path, name| path.key(name));
        self.source.error(fault, &path, message)
    }

    /// Fields that contradict each other.
    pub(crate) fn clash<T>(&self, field: &str, message: impl Into<String>) -> Result<T, SceneError> {
        Err(self.error(Fault::Inconsistent, field, message))
    }
}

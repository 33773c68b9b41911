//! Where a part of a scene stands, for messages: its path, and the text that it was read from.

use crate::{
    error::{ErrorKind, SceneError},
    source::{Path, Source},
};

/// A part of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Location<'a> {
    path: Path,
    source: &'a Source,
}

impl<'a> Location<'a> {
    /// The whole scene.
    pub(crate) fn root(source: &'a Source) -> Self {
        Self { path: Path::default(), source }
    }

    /// The key `name` of this part.
    pub(crate) fn key(&self, name: &str) -> Self {
        Self { path: self.path.key(name), source: self.source }
    }

    /// The element `index` of this part.
    pub(crate) fn index(&self, index: usize) -> Self {
        Self { path: self.path.index(index), source: self.source }
    }

    /// An error in this part.
    pub(crate) fn error(&self, kind: ErrorKind, message: impl Into<String>) -> SceneError {
        self.source.error(kind, &self.path, message)
    }

    /// An error of keys that contradict each other.
    pub(crate) fn inconsistent<T>(&self, message: impl Into<String>) -> Result<T, SceneError> {
        Err(self.error(ErrorKind::Inconsistent, message))
    }
}

//! Values that take the place of others in a text, and what stands in their way.

use crate::{
    error::{ErrorKind, Found, SceneErrors},
    source::{Path, Source},
};

/// Values for a text, and errors, as they are found.
pub(super) struct Edits<'a> {
    source: &'a Source,
    values: Vec<(Path, String)>,
    found: Found,
}

impl<'a> Edits<'a> {
    /// None, of the text of a source.
    pub(super) fn new(source: &'a Source) -> Self {
        Self { source, values: Vec::new(), found: Found::default() }
    }

    /// A number in the place of another. Its digits are those that people write: 15, so that 3 times 0.1 is 0.3.
    fn number(&mut self, path: Path, value: f64) {
        let rounded = format!("{value:.14e}").parse().unwrap_or(value);
        self.values.push((path, format!("{rounded:?}")));
    }

    /// A number times a factor. One that is 0 stays, for it need not stand in the text.
    pub(super) fn scaled(&mut self, path: Path, value: f64, factor: f64) {
        if value != 0.0 && factor != 1.0 {
            self.number(path, value * factor);
        }
    }

    /// A whole number in the place of another.
    pub(super) fn whole(&mut self, path: Path, value: u32) {
        self.values.push((path, value.to_string()));
    }

    /// Keeps an error in a key.
    pub(super) fn refuse(&mut self, kind: ErrorKind, path: &Path, message: impl Into<String>) {
        self.found.add(self.source.error(kind, path, message));
    }

    /// The text with these values.
    ///
    /// # Errors
    /// Everything that stood in the way.
    pub(super) fn text(mut self) -> Result<String, SceneErrors> {
        let text = self.source.text_with(&self.values);
        if text.is_none() {
            self.refuse(
                ErrorKind::Missing,
                &Path::default(),
                "a value that is to be changed is not in the text",
            );
        }
        self.found.or(text.unwrap_or_default())
    }
}

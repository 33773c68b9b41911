//! Where a key of a scene stands: paths such as `body[0].mesh.grid`, and their lines.

use std::{cmp::Reverse, fmt, ops::Range, sync::Arc};

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use crate::error::{ErrorKind, SceneError};

/// One step into a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Part {
    Key(String),
    Index(usize),
}

/// The way from a scene's root to a key.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Path(Vec<Part>);

impl Path {
    /// The key `name` of what this path names.
    pub(crate) fn key(&self, name: &str) -> Self {
        let mut parts = self.0.clone();
        parts.push(Part::Key(name.to_owned()));
        Self(parts)
    }

    /// The element `index` of what this path names.
    pub(crate) fn index(&self, index: usize) -> Self {
        let mut parts = self.0.clone();
        parts.push(Part::Index(index));
        Self(parts)
    }

    /// The path as the header of a table has it, without places in arrays: `body.springs`.
    pub(crate) fn header(&self) -> String {
        let name = |part: &Part| match part {
            Part::Key(name) => Some(name.clone()),
            Part::Index(_) => None,
        };
        self.0.iter().filter_map(name).collect::<Vec<_>>().join(".")
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, part) in self.0.iter().enumerate() {
            match part {
                Part::Key(name) if i == 0 => f.write_str(name)?,
                Part::Key(name) => write!(f, ".{name}")?,
                Part::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

/// A key that stands in the text under an old name.
#[derive(Clone, Debug)]
pub(crate) struct OldKey {
    /// The way to it, with its new name.
    pub path: Path,
    /// Where its value stands.
    pub span: Range<usize>,
    pub warning: String,
}

/// The text that a scene was read from; empty for a scene made by a program.
#[derive(Clone, Debug, Default)]
pub struct Source {
    file: String,
    text: Arc<str>,
    old_keys: Vec<OldKey>,
}

/// Scenes are equal when their fields are, wherever they were read from.
impl PartialEq for Source {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Source {
    pub(crate) fn new(file: &str, text: &str) -> Self {
        Self { file: file.to_owned(), text: text.into(), old_keys: Vec::new() }
    }

    /// The text; empty for a scene made by a program.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// The same text, in which these keys have old names.
    pub(crate) fn with_old_keys(self, old_keys: Vec<OldKey>) -> Self {
        Self { old_keys, ..self }
    }

    /// The same file without its text: errors name the key alone.
    pub(crate) fn without_text(&self) -> Self {
        Self { file: self.file.clone(), ..Self::default() }
    }

    /// A warning for each key under an old name.
    pub(crate) fn warnings(&self) -> Vec<String> {
        self.old_keys.iter().map(|key| key.warning.clone()).collect()
    }

    /// An error in the key that `path` names.
    pub(crate) fn error(&self, kind: ErrorKind, path: &Path, message: impl Into<String>) -> SceneError {
        let error = SceneError::new(kind, &self.file, message).for_key(path.to_string());
        match self.find(path) {
            Some(span) => self.locate(error, &span),
            None => error,
        }
    }

    /// An error at a known position in the text.
    pub(crate) fn error_at(
        &self,
        kind: ErrorKind,
        path: &Path,
        span: &Range<usize>,
        message: impl Into<String>,
    ) -> SceneError {
        self.locate(SceneError::new(kind, &self.file, message).for_key(path.to_string()), span)
    }

    /// A warning about the name of a key, with its position, as an error would have it.
    pub(crate) fn warning_at(&self, path: &Path, span: &Range<usize>, message: impl Into<String>) -> String {
        self.error_at(ErrorKind::UnknownField, path, span, message).to_string()
    }

    /// The same text with other values where these paths lead, as they are to be written; all else stays, comments too. None where a
    /// path leads to nothing.
    pub(crate) fn text_with(&self, values: &[(Path, String)]) -> Option<String> {
        let table = DeTable::parse(&self.text).ok()?;
        let root = Spanned::new(table.span(), DeValue::Table(table.into_inner()));
        let mut places = Vec::with_capacity(values.len());
        for (path, value) in values {
            let found = path.0.iter().try_fold(&root, inner)?;
            places.push((found.span(), value));
        }

        // From the end on, so that places stay where they are.
        places.sort_by_key(|(span, _)| Reverse(span.start));
        let mut text = (*self.text).to_owned();
        for (span, value) in places {
            text.replace_range(span, value);
        }
        Some(text)
    }

    fn locate(&self, error: SceneError, span: &Range<usize>) -> SceneError {
        if self.text.is_empty() {
            return error;
        }
        let (line, column) = self.line_and_column(span.start);
        error.at_line(line).at_column(column)
    }

    fn line_and_column(&self, byte: usize) -> (usize, usize) {
        // The end of a text is the end of its last line, and not a line after it that no editor shows.
        let last = self.text.strip_suffix('\n').unwrap_or(&self.text);
        let last = last.strip_suffix('\r').unwrap_or(last).len();
        let byte = if byte < self.text.len() { byte } else { last };
        let end = (0..=byte).rev().find(|i| self.text.is_char_boundary(*i)).unwrap_or(0);
        let before = &self.text[..end];
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
    }

    /// The deepest part of `path` that the text has. Only errors need it, so the text is read again.
    fn find(&self, path: &Path) -> Option<Range<usize>> {
        if self.text.is_empty() {
            return None;
        }
        if let Some(key) = self.old_keys.iter().find(|key| key.path == *path) {
            return Some(key.span.clone());
        }

        let table = DeTable::parse(&self.text).ok()?;
        let root = Spanned::new(table.span(), DeValue::Table(table.into_inner()));
        let mut value = &root;
        for part in &path.0 {
            let Some(next) = inner(value, part) else { break };
            value = next;
        }

        Some(value.span())
    }
}

/// What a step leads to.
fn inner<'a, 'b>(value: &'a Spanned<DeValue<'b>>, part: &Part) -> Option<&'a Spanned<DeValue<'b>>> {
    match (part, value.get_ref()) {
        (Part::Key(name), DeValue::Table(table)) => table.get(name.as_str()),
        (Part::Index(index), DeValue::Array(items)) => items.get(*index),
        _ => None,
    }
}

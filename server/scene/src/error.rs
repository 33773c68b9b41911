//! What is wrong with a text and where: one error type for scenes, meshes and parameter files.
//!
//! A message says what was found and what is allowed, and names file, line and column.

use std::fmt;

use crate::printable::printable;

/// What kind of error it is, for programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ErrorKind {
    /// The text cannot be read as what it should be.
    Syntax,
    /// A key that does not exist.
    UnknownField,
    /// A key that is needed and absent.
    Missing,
    /// A value of another type than the key's.
    WrongType,
    /// A value outside the key's range.
    OutOfRange,
    /// Keys that contradict each other.
    Inconsistent,
    /// Something that this program knows and does not do.
    Unsupported,
    /// More than the caller allows.
    TooLarge,
    /// A mesh that does not exist.
    MeshNotFound,
    /// A mesh that cannot be simulated.
    BadMesh,
    /// A file that is there already, and stays.
    Exists,
    /// A file that cannot be read or written.
    Io,
}

impl ErrorKind {
    /// A stable word for programs.
    pub const fn reason(self) -> &'static str {
        match self {
            Self::Syntax => "SYNTAX",
            Self::UnknownField => "UNKNOWN_FIELD",
            Self::Missing => "MISSING",
            Self::WrongType => "WRONG_TYPE",
            Self::OutOfRange => "OUT_OF_RANGE",
            Self::Inconsistent => "INCONSISTENT",
            Self::Unsupported => "UNSUPPORTED",
            Self::TooLarge => "TOO_LARGE",
            Self::MeshNotFound => "MESH_NOT_FOUND",
            Self::BadMesh => "BAD_MESH",
            Self::Exists => "EXISTS",
            Self::Io => "IO",
        }
    }
}

/// An error in a text, and where it stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// What kind of error it is.
    pub kind: ErrorKind,
    /// File, as the caller named it; empty when there is none.
    pub file: String,
    /// Line, from 1; 0 when the error has no line.
    pub line: usize,
    /// Column in characters, from 1; 0 when the error has none.
    pub column: usize,
    /// The key, with the way to it: `body[0].mesh.grid`; empty when the error concerns no key.
    pub key: String,
    /// What was found and what is allowed.
    pub message: String,
}

impl SceneError {
    /// An error somewhere in a file. What its text quotes is made printable.
    pub fn new(kind: ErrorKind, file: &str, message: impl Into<String>) -> Self {
        let (file, key) = (printable(file).into_owned(), String::new());
        let message = message.into().lines().map(printable).collect::<Vec<_>>().join("\n");
        Self { kind, file, line: 0, column: 0, key, message }
    }

    /// The same error in a line, from 1.
    #[must_use]
    pub fn at_line(mut self, line: usize) -> Self {
        self.line = line;
        self
    }

    /// The same error at a column, from 1.
    #[must_use]
    pub fn at_column(mut self, column: usize) -> Self {
        self.column = column;
        self
    }

    /// The same error in a key.
    #[must_use]
    pub fn for_key(mut self, key: impl Into<String>) -> Self {
        self.key = printable(&key.into()).into_owned();
        self
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.file.is_empty() {
            f.write_str(&self.file)?;
            if self.line > 0 {
                write!(f, ":{}", self.line)?;
            }
            if self.column > 0 {
                write!(f, ":{}", self.column)?;
            }
            f.write_str(": ")?;
        }

        if !self.key.is_empty() {
            write!(f, "{}: ", self.key)?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for SceneError {}

/// Everything that is wrong with a scene, in the order of its text: at least one error, and at most
/// [`SceneErrors::LIMIT`] of them, with the number of the others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneErrors {
    errors: Vec<SceneError>,
    omitted: usize,
}

impl SceneErrors {
    /// How many errors of one scene are kept.
    pub const LIMIT: usize = 20;

    /// The first error.
    pub fn first(&self) -> &SceneError {
        &self.errors[0]
    }

    /// The errors that are kept.
    pub fn iter(&self) -> std::slice::Iter<'_, SceneError> {
        self.errors.iter()
    }

    /// How many errors are left out because there are more than [`SceneErrors::LIMIT`]; 0: none.
    pub fn omitted(&self) -> usize {
        self.omitted
    }
}

impl<'a> IntoIterator for &'a SceneErrors {
    type Item = &'a SceneError;
    type IntoIter = std::slice::Iter<'a, SceneError>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl From<SceneError> for SceneErrors {
    fn from(error: SceneError) -> Self {
        Self { errors: vec![error], omitted: 0 }
    }
}

impl fmt::Display for SceneErrors {
    /// One error per line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.errors[0])?;
        for error in &self.errors[1..] {
            write!(f, "\n{error}")?;
        }
        match self.omitted {
            0 => Ok(()),
            count => write!(f, "\n{count} more"),
        }
    }
}

impl std::error::Error for SceneErrors {}

/// Errors as they are found, so that a scene with several names all of them.
#[derive(Debug, Default)]
pub(crate) struct Found {
    errors: Vec<SceneError>,
    beyond: usize,
}

impl Found {
    /// Errors kept until they are put in order: a bound on memory.
    const MOST: usize = 1000;

    /// Keeps an error.
    pub(crate) fn add(&mut self, error: SceneError) {
        if self.errors.len() < Self::MOST {
            self.errors.push(error);
        } else {
            self.beyond += 1;
        }
    }

    /// The value of a result; an error is kept.
    pub(crate) fn take<T>(&mut self, result: Result<T, SceneError>) -> Option<T> {
        result.map_err(|error| self.add(error)).ok()
    }

    /// The value, or everything found if there is an error.
    pub(crate) fn or<T>(mut self, value: T) -> Result<T, SceneErrors> {
        if self.errors.is_empty() {
            return Ok(value);
        }

        // Into the order of the text: tables are read in the order of their keys' names.
        self.errors.sort_by_key(|error| (error.line, error.column));
        let omitted = self.errors.len().saturating_sub(SceneErrors::LIMIT) + self.beyond;
        self.errors.truncate(SceneErrors::LIMIT);
        Err(SceneErrors { errors: self.errors, omitted })
    }
}

/// The known name that is nearest to what was written, if it is near.
pub(crate) fn nearest<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = found.to_lowercase();
    known
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(&lower, &name.to_lowercase()), name))
        .min()
        .filter(|(distance, name)| *distance <= 1 + name.len().max(found.len()) / 4)
        .map(|(_, name)| name)
}

/// `did you mean 'x'?` when a known name is near to what was written, else the known names, or that there are none.
pub fn suggestion<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    match nearest(found, known.iter().copied()) {
        Some(name) => format!("did you mean '{name}'?"),
        None if known.is_empty() => "there are none".to_owned(),
        None => format!("allowed: {}", known.join(", ")),
    }
}

/// At most 40 characters of something found, for a message.
pub(crate) fn excerpt(found: &str) -> String {
    let mut short: String = found.chars().take(40).collect();
    if short.len() < found.len() {
        short.push_str("...");
    }
    short
}

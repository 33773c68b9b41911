//! What is wrong with a text and where: one error type for scenes, meshes and parameter files.
//!
//! A message says what was found and what is allowed; the place is a file, a line and a column.

use std::fmt;

/// What kind of fault it is, for programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The text cannot be read as what it should be.
    Syntax,
    /// A field that does not exist.
    UnknownField,
    /// A field that is needed and absent.
    Missing,
    /// A value of another type than the field's.
    WrongType,
    /// A value outside the field's range.
    OutOfRange,
    /// Fields that contradict each other.
    Inconsistent,
    /// Something that this program knows and does not do.
    Unsupported,
    /// More than the caller allows.
    TooLarge,
    /// A mesh that does not exist.
    MeshNotFound,
    /// A mesh that cannot be simulated.
    BadMesh,
    /// A file that cannot be read or written.
    Io,
}

impl Fault {
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
            Self::Io => "IO",
        }
    }
}

/// A fault in a text, with its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// Kind.
    pub fault: Fault,
    /// File, as the caller named it; empty when there is none.
    pub file: String,
    /// Line, from 1; 0 when the fault has no line.
    pub line: usize,
    /// Column in characters, from 1; 0 when the fault has none.
    pub column: usize,
    /// Field, `body[0].mesh.grid`; empty when the fault is in no field.
    pub field: String,
    /// What was found and what is allowed.
    pub message: String,
}

impl SceneError {
    /// A fault somewhere in a file.
    pub fn new(fault: Fault, file: &str, message: impl Into<String>) -> Self {
        let (file, field, message) = (file.to_owned(), String::new(), message.into());
        Self { fault, file, line: 0, column: 0, field, message }
    }

    /// The same fault in a line, from 1.
    #[must_use]
    pub fn at_line(mut self, line: usize) -> Self {
        self.line = line;
        self
    }

    /// The same fault at a column, from 1.
    #[must_use]
    pub fn at_column(mut self, column: usize) -> Self {
        self.column = column;
        self
    }

    /// The same fault in a field.
    #[must_use]
    pub fn in_field(mut self, field: impl Into<String>) -> Self {
        self.field = field.into();
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
        if !self.field.is_empty() {
            write!(f, "{}: ", self.field)?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for SceneError {}

/// `; did you mean 'x'?` when a known name is near to what was written, else the known names.
pub(crate) fn suggestion<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let lower = found.to_lowercase();
    let near = known
        .iter()
        .map(|name| (strsim::damerau_levenshtein(&lower, &name.to_lowercase()), *name))
        .min()
        .filter(|(distance, name)| *distance <= 1 + name.len().max(found.len()) / 4);
    match near {
        Some((_, name)) => format!("did you mean '{name}'?"),
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

//! What becomes of a method in a scene.

use std::fmt;

use nappe_sim::report::StepError;

/// What became of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// It did what it should, and what is worth a number.
    Survived(String),
    /// It did so in steps other than those asked for.
    Recovered(String),
    /// It did not, and says so.
    Detected(String),
    /// It may not, and said so before the first step; what was sent is as right as the warning says.
    Warned(String),
    /// It did not, and does not say so.
    Lost(String),
    /// The scene does not concern it.
    None,
}

impl Verdict {
    /// All steps were taken, some of them again.
    pub(super) fn taken(rejected: u32) -> Self {
        match rejected {
            0 => Self::Survived(String::new()),
            1 => Self::Recovered("1 step again".to_owned()),
            _ => Self::Recovered(format!("{rejected} steps again")),
        }
    }

    /// A step failed, and the program said why.
    pub(super) fn stopped(error: &StepError) -> Self {
        Self::Detected(format!("`{}` at step {}", error.failure.reason(), error.step))
    }

    /// Survived, or recovered if it was that already.
    pub(super) fn with(self, what: String) -> Self {
        match self {
            Self::Survived(how) if how.is_empty() => Self::Survived(what),
            Self::Survived(how) => Self::Survived(format!("{how}; {what}")),
            Self::Recovered(how) => Self::Recovered(format!("{how}; {what}")),
            other => other,
        }
    }

    /// Lost, unless something holds that must.
    #[must_use]
    pub fn only_if(self, holds: impl Fn() -> bool, otherwise: impl FnOnce() -> String) -> Self {
        match self {
            Self::Survived(_) | Self::Recovered(_) if !holds() => Self::Lost(otherwise()),
            other => other,
        }
    }
}

impl Verdict {
    /// Its name in gallery.csv; empty where the scene does not concern the method.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Survived(_) => "survived",
            Self::Recovered(_) => "recovered",
            Self::Detected(_) => "detected",
            Self::Warned(_) => "warned",
            Self::Lost(_) => "lost",
            Self::None => "",
        }
    }

    /// The first letter of its name; a dot where the scene does not concern the method.
    pub const fn letter(&self) -> char {
        match self {
            Self::Survived(_) => 'S',
            Self::Recovered(_) => 'R',
            Self::Detected(_) => 'D',
            Self::Warned(_) => 'W',
            Self::Lost(_) => 'L',
            Self::None => '.',
        }
    }

    /// Numbers and reasons beside it; empty where there are none.
    pub fn detail(&self) -> &str {
        match self {
            Self::Survived(how)
            | Self::Recovered(how)
            | Self::Detected(how)
            | Self::Warned(how)
            | Self::Lost(how) => how,
            Self::None => "",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Survived(what) if what.is_empty() => f.write_str("survived"),
            Self::Survived(what) => write!(f, "survived: {what}"),
            Self::Recovered(how) => write!(f, "recovered: {how}"),
            Self::Detected(how) => write!(f, "detected: {how}"),
            Self::Warned(how) => write!(f, "warned: {how}"),
            Self::Lost(how) => write!(f, "LOST: {how}"),
            Self::None => f.write_str("-"),
        }
    }
}

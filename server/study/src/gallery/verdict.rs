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
    /// It ended without an error, and what it found is beyond a threshold of its scene: not what the scene asks for.
    Wrong(String),
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

    /// The same of a run that was taken to its end, and what is worth a number.
    pub(super) fn with(self, what: String) -> Self {
        match self {
            Self::Survived(how) => Self::Survived(joined(&how, what)),
            Self::Recovered(how) => Self::Recovered(joined(&how, what)),
            Self::Wrong(how) => Self::Wrong(joined(&how, what)),
            other => other,
        }
    }

    /// Lost, unless something holds that must.
    #[must_use]
    pub fn only_if(self, holds: impl Fn() -> bool, otherwise: impl FnOnce() -> String) -> Self {
        match self {
            Self::Survived(_) | Self::Recovered(_) | Self::Wrong(_) if !holds() => Self::Lost(otherwise()),
            other => other,
        }
    }

    /// Wrong, unless what was found is within the threshold of its scene.
    #[must_use]
    pub(super) fn right_if(self, holds: impl Fn() -> bool) -> Self {
        match self {
            Self::Survived(how) | Self::Recovered(how) if !holds() => Self::Wrong(how),
            other => other,
        }
    }
}

/// Two things that are said of a run.
fn joined(how: &str, what: String) -> String {
    if how.is_empty() { what } else { format!("{how}; {what}") }
}

impl Verdict {
    /// Its name in gallery.csv; empty where the scene does not concern the method.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Survived(_) => "survived",
            Self::Recovered(_) => "recovered",
            Self::Detected(_) => "detected",
            Self::Wrong(_) => "wrong",
            Self::Warned(_) => "warned",
            Self::Lost(_) => "lost",
            Self::None => "",
        }
    }

    /// The first letter of its name, X of wrong; a dot where the scene does not concern the method.
    pub const fn letter(&self) -> char {
        match self {
            Self::Survived(_) => 'S',
            Self::Recovered(_) => 'R',
            Self::Detected(_) => 'D',
            Self::Wrong(_) => 'X',
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
            | Self::Wrong(how)
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
            Self::Wrong(how) => write!(f, "wrong: {how}"),
            Self::Warned(how) => write!(f, "warned: {how}"),
            Self::Lost(how) => write!(f, "LOST: {how}"),
            Self::None => f.write_str("-"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beyond_its_threshold_is_wrong_and_keeps_what_is_said_of_it() {
        let taken = || Verdict::taken(2).with("3 J".to_owned());
        assert_eq!(taken().right_if(|| true), Verdict::Recovered("2 steps again; 3 J".to_owned()));
        let wrong = taken().right_if(|| false);
        assert_eq!(wrong.to_string(), "wrong: 2 steps again; 3 J");
        assert_eq!((wrong.name(), wrong.letter()), ("wrong", 'X'));
        assert_eq!(wrong.clone().with("0.1 m".to_owned()).detail(), "2 steps again; 3 J; 0.1 m");
        assert_eq!(wrong.only_if(|| false, || "no end".to_owned()), Verdict::Lost("no end".to_owned()));
        let detected = Verdict::Detected("`ENERGY_GAIN` at step 0".to_owned());
        assert_eq!(detected.clone().right_if(|| false), detected);
    }
}

//! What becomes of a method in a scene: a verdict, and what is said beside it.

use std::fmt;

use nappe_sim::report::StepError;

use crate::run::Verdict;

/// What became of a method in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// How it is judged.
    pub verdict: Verdict,
    /// Numbers and reasons beside it; empty where there are none.
    pub detail: String,
}

impl Finding {
    /// That of a scene that does not concern the method.
    pub(super) const NONE: Self = Self { verdict: Verdict::None, detail: String::new() };

    /// A verdict, and what is said beside it.
    pub fn new(verdict: Verdict, detail: impl Into<String>) -> Self {
        Self { verdict, detail: detail.into() }
    }

    /// All steps were taken, some of them again.
    pub(super) fn taken(rejected: u32) -> Self {
        match rejected {
            0 => Self::new(Verdict::Survived, ""),
            1 => Self::new(Verdict::Recovered, "1 step again"),
            _ => Self::new(Verdict::Recovered, format!("{rejected} steps again")),
        }
    }

    /// A step failed, and the program said why.
    pub(super) fn stopped(error: &StepError) -> Self {
        Self::new(Verdict::Detected, format!("`{}` at step {}", error.failure.reason(), error.step))
    }

    /// The same of a run that was taken to its end, and what is worth a number.
    pub(super) fn with(mut self, what: &str) -> Self {
        if self.verdict.holds() {
            let between = if self.detail.is_empty() { "" } else { "; " };
            self.detail = format!("{}{between}{what}", self.detail);
        }
        self
    }

    /// Lost, unless something holds that must.
    #[must_use]
    pub fn only_if(self, holds: impl Fn() -> bool, otherwise: impl FnOnce() -> String) -> Self {
        if self.verdict.holds() && !holds() { Self::new(Verdict::Lost, otherwise()) } else { self }
    }

    /// Wrong, unless what was found is within the threshold of its scene.
    #[must_use]
    pub(super) fn right_if(self, holds: impl Fn() -> bool) -> Self {
        if self.verdict.holds() && !holds() { Self { verdict: Verdict::Wrong, ..self } } else { self }
    }

    /// The first letter of the name of its verdict, X of wrong; a dot where the scene does not concern the method.
    pub fn letter(&self) -> char {
        let first = self.verdict.name().chars().next();
        if self.verdict == Verdict::Wrong {
            'X'
        } else {
            first.map_or('.', |first| first.to_ascii_uppercase())
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = if self.verdict == Verdict::Lost { "LOST" } else { self.verdict.name() };
        match (name, self.detail.as_str()) {
            ("", _) => f.write_str("-"),
            (name, "") => f.write_str(name),
            (name, detail) => write!(f, "{name}: {detail}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beyond_its_threshold_is_wrong_and_keeps_what_is_said_of_it() {
        let taken = || Finding::taken(2).with("3 J");
        assert_eq!(taken().right_if(|| true), Finding::new(Verdict::Recovered, "2 steps again; 3 J"));
        let wrong = taken().right_if(|| false);
        assert_eq!(wrong.to_string(), "wrong: 2 steps again; 3 J");
        assert_eq!((wrong.verdict.name(), wrong.letter()), ("wrong", 'X'));
        assert_eq!(wrong.clone().with("0.1 m").detail, "2 steps again; 3 J; 0.1 m");
        let lost = wrong.only_if(|| false, || "no end".to_owned());
        assert_eq!((lost.letter(), lost.to_string().as_str()), ('L', "LOST: no end"));
        let detected = Finding::new(Verdict::Detected, "`ENERGY_GAIN` at step 0");
        assert_eq!(detected.clone().right_if(|| false), detected);
        assert_eq!((Finding::NONE.letter(), Finding::NONE.to_string().as_str()), ('.', "-"));
    }
}

//! How a run ended: what happened to it, and how it is judged.

use super::budget::Cut;

/// What happened to a run.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// It came to its end.
    Reached,
    /// A step could not be taken, or led to what is no state, or to what is no answer.
    Failed(Failure),
    /// Given up: its time was over, or the study was ended.
    Cut(Cut),
    /// Given up: it took more evaluations and products than it was allowed.
    Costly,
}

/// Why a run did not reach its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// In a sentence.
    pub cause: String,
    /// Simulated time (s).
    pub time: f64,
    /// At which particle, in the user's numbering.
    pub particle: Option<u64>,
    /// Whether a step was refused, and none led astray.
    pub is_refusal: bool,
}

impl End {
    /// Its name in tables.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Reached => "ok",
            Self::Failed(Failure { is_refusal: true, .. }) => "refused",
            Self::Failed(Failure { is_refusal: false, .. }) => "diverged",
            Self::Cut(_) => "not_known",
            Self::Costly => "costly",
        }
    }

    /// Why it failed, if it did.
    pub const fn failure(&self) -> Option<&Failure> {
        match self {
            Self::Failed(failure) => Some(failure),
            Self::Reached | Self::Cut(_) | Self::Costly => None,
        }
    }

    /// Why it was given up, if it was for want of time.
    pub const fn cut(&self) -> Option<Cut> {
        match self {
            Self::Cut(cut) => Some(*cut),
            Self::Reached | Self::Failed(_) | Self::Costly => None,
        }
    }
}

/// How a run is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Of raw steps: its energy stayed within what is allowed, and its error too where that is known.
    Stable,
    /// Its numbers are finite, its energy is above what is allowed.
    Grows,
    /// Its energy stayed, its error did not, or what it found is beyond a threshold of its scene; of steps as the program takes
    /// them too.
    Wrong,
    /// A step led to what is no state.
    Diverged,
    /// A linear solve met a curvature that is not positive.
    Indefinite,
    /// It could not begin.
    Refused,
    /// It was not followed to its end, or cannot be judged: why stands beside it.
    NotKnown,
    /// Of steps as the program takes them: each as it was asked for, and it did what it should.
    Survived,
    /// The program made them shorter.
    Recovered,
    /// The program ended the run with a reason.
    Detected,
    /// The program said before the first step that it may fail; what was sent is as right as the warning says.
    Warned,
    /// It lost its way without a word.
    Lost,
    /// There is none: the scene does not concern the method.
    None,
}

impl Verdict {
    /// Its name in tables; empty where there is none.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Grows => "grows",
            Self::Wrong => "wrong",
            Self::Diverged => "diverged",
            Self::Indefinite => "indefinite",
            Self::Refused => "refused",
            Self::NotKnown => "not_known",
            Self::Survived => "survived",
            Self::Recovered => "recovered",
            Self::Detected => "detected",
            Self::Warned => "warned",
            Self::Lost => "lost",
            Self::None => "",
        }
    }

    /// Whether the run came to its end, and its energy stayed within what is allowed.
    pub const fn holds(self) -> bool {
        matches!(self, Self::Stable | Self::Wrong | Self::Survived | Self::Recovered)
    }

    /// Whether the method failed.
    pub const fn is_failure(self) -> bool {
        matches!(self, Self::Grows | Self::Diverged | Self::Indefinite | Self::Detected | Self::Lost)
    }
}

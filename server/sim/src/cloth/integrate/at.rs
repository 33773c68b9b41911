//! At which state a linear solve of a step is made, and where its solution starts from.

use crate::cloth::settings::ClothSettings;

/// Which state was evaluated.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum At {
    /// That at the start of the step: its solve may start from that of the step before.
    State,
    /// The same, of which surfaces are kept apart: the solve of a round, counted from 0, with the pairs that push. From the second on it starts
    /// from that of the round before.
    Round(u32),
    /// The iterate in the `next` of the step.
    Iterate,
    /// The same, a balance: the solve looks for a direction of negative curvature.
    Balance,
}

/// Where the solution of a solve starts from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Guess {
    Zero,
    StepBefore,
    /// The change of velocity that another solve came to: that of the round before, or the one that goes on with patches.
    Here,
}

impl At {
    /// Where its solve starts from.
    pub(super) fn guess(self, settings: &ClothSettings) -> Guess {
        match self {
            Self::State | Self::Round(0) if settings.solver.warm_start => Guess::StepBefore,
            Self::State | Self::Round(0) | Self::Iterate | Self::Balance => Guess::Zero,
            Self::Round(_) => Guess::Here,
        }
    }

    /// Where a solve goes on that came to an end too early. One that looks for a direction begins anew: what it has found would hide it.
    pub(super) fn again(self) -> Guess {
        if self == Self::Balance { Guess::Zero } else { Guess::Here }
    }

    /// Whether the iterate in `next` was evaluated.
    pub(super) fn is_iterate(self) -> bool {
        matches!(self, Self::Iterate | Self::Balance)
    }
}

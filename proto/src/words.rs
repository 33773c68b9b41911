//! Values of enums as words, for people and for JSON.

use crate::v1::{Precision, SessionState, SolveOutcome, SpringKind, TimeBound, WakeCause};

/// Gives values of enums their words.
macro_rules! words {
    ($($(#[$about:meta])* $kind:ident,)+) => {
        $(impl $kind {
            $(#[$about])*
            pub fn word(self) -> String {
                word(self.as_str_name(), Self::Unspecified.as_str_name())
            }
        })+
    };
}

words! {
    /// `paused`, `playing`, `finished`, `failed`; `unknown` if unspecified.
    SessionState,
    /// `f32`, `f64`; `unknown` if unspecified.
    Precision,
    /// `stretch`, `shear`, `bend`; `unknown` if unspecified.
    SpringKind,
    /// `elastic_wave`, `particle_speed` and so on; `unknown` if unspecified, or of a newer server.
    TimeBound,
    /// `call`, `collider` and so on; `unknown` if unspecified, or of a newer server.
    WakeCause,
    /// `converged`, `iteration_cap` and so on; `unknown` if unspecified, or of a newer server.
    SolveOutcome,
}

/// A value's name in lower case, without the prefix that all names of its enum share with the one of value 0.
fn word(name: &str, unspecified: &str) -> String {
    if name == unspecified {
        return "unknown".to_owned();
    }
    let prefix = unspecified.trim_end_matches("UNSPECIFIED");
    name.trim_start_matches(prefix).to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_the_name_without_its_enum() {
        assert_eq!(SessionState::Paused.word(), "paused");
        assert_eq!(Precision::F64.word(), "f64");
        assert_eq!(TimeBound::ElasticWave.word(), "elastic_wave");
        assert_eq!(WakeCause::Collider.word(), "collider");
        assert_eq!(SolveOutcome::IterationCap.word(), "iteration_cap");
        assert_eq!(SessionState::Unspecified.word(), "unknown");
    }
}

//! The energy that contacts give an implicit step: what keeps particles out of a solid, one by one, stretches springs.
//!
//! It is more the longer a step is, and it adds up. So it is kept in a book: what contacts give is owed, what is lost later pays
//! it back, and a sub-step after which more is owed than a share of what moves and is stretched is not accepted.

use crate::cloth::state::{Allowance, Judged};

/// Share of the kinetic and elastic energy that may be owed.
const SHARE: f64 = 0.05;

/// What may be owed after a sub-step (J), by the greatest energy that moves and is stretched in it without contact.
pub(crate) fn most_owed(moved: f64) -> f64 {
    SHARE * moved
}

/// What is owed (J) after a sub-step of which the energy rose by `rise` (J).
pub(crate) fn owed(before: f64, rise: f64, allowed: &Allowance, judged: Judged) -> f64 {
    let gain = rise - allowed.given;
    let counted = if judged == Judged::Yes { gain } else { gain.min(0.0) };
    (before + counted).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_contacts_give_is_owed_until_it_is_lost() {
        let allowed = Allowance { given: 0.5, limit: 0.5, most: 1.0, owes: false };
        let gained = owed(1.0, 2.5, &allowed, Judged::Yes);
        assert_eq!(gained, 3.0);
        assert_eq!(owed(gained, 2.5, &allowed, Judged::No), 3.0);
        assert_eq!(owed(gained, -0.5, &allowed, Judged::No), 2.0);
        assert_eq!(owed(gained, -9.0, &allowed, Judged::Yes), 0.0);
        assert_eq!(most_owed(8.0), 8.0 * SHARE);
    }
}

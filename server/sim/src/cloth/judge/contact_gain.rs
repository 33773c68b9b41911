//! The energy that contacts give an implicit step: what keeps particles out of a solid, one by one, stretches springs.
//!
//! It is more the longer a step is, and it adds up. So it is kept in a book: what contacts give is owed, what is lost later pays
//! it back, and a sub-step after which more is owed than a share of what moves and is stretched is not accepted. What moves is
//! seen from the surfaces that were touched, from which a contact gives nothing.

use crate::{
    cloth::{
        evaluate::{Allowance, Common, Judged, Sums, kinetic_of},
        layout::Part,
    },
    math::Vec3,
};

/// Share of the kinetic and elastic energy that may be owed.
const SHARE: f64 = 0.05;

/// What may be owed after a sub-step (J), by the greatest energy that moves and is stretched in it without contact, seen from
/// surfaces that move with a velocity (m/s); `sums` are those of several parts, after contact.
pub(crate) fn most_owed(
    allowed: &Allowance,
    (parts, sums, common): (&[Part], &[Sums], &Common),
    surfaces: Vec3<f64>,
) -> f64 {
    let [before, after] = &allowed.totals;
    let whole = match parts {
        [part] => [before, after].map(|total| kinetic_of(part, Vec3::from(total.momentum), surfaces)),
        _ => common.kinetic_from(parts, sums, surfaces),
    };
    SHARE * (before.moved() - whole[0]).max(after.moved() - whole[1]).max(0.0)
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
    use crate::cloth::evaluate::Total;

    #[test]
    fn what_contacts_give_is_owed_until_it_is_lost() {
        let mut sums = [0.0; 18];
        (sums[0], sums[3]) = (8.0, 8.0);
        let moving = Total::of(sums);
        let allowed = Allowance {
            given: 0.5,
            at_rest: 0.0,
            limit: 0.5,
            judged: Judged::Yes,
            owes: false,
            totals: [Total::default(), moving],
        };
        let gained = owed(1.0, 2.5, &allowed, Judged::Yes);
        assert_eq!(gained, 3.0);
        assert_eq!(owed(gained, 2.5, &allowed, Judged::No), 3.0);
        assert_eq!(owed(gained, -0.5, &allowed, Judged::No), 2.0);
        assert_eq!(owed(gained, -9.0, &allowed, Judged::Yes), 0.0);

        // 4 kg at 2 m/s, seen from the floor and from what goes along.
        let part = Part { mass: 4.0, count: 1, ..Part::default() };
        let most = |velocity: f64| {
            let seen = (&[part][..], &[][..], &Common::default());
            most_owed(&allowed, seen, Vec3::new(velocity, 0.0, 0.0))
        };
        assert_eq!([most(0.0), most(2.0)], [8.0 * SHARE, 8.0 * SHARE]);
        assert_eq!(most(-1.0), 18.0 * SHARE);
    }
}

//! Parameters as they are now: what changes between steps can change.

use crate::{
    cloth::{Air, LawEntry, SpringKind},
    collide::Pose,
};

/// Gravity, wind, what each cloth is made of, and where colliders are.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldParameters {
    /// Gravity (m/s²).
    pub gravity: [f64; 3],
    /// Velocity of the medium (m/s).
    pub wind: [f64; 3],
    /// The cloths, in the order of the setup.
    pub cloths: Vec<ClothParameters>,
    /// Names of the colliders with their poses now, in the order of the setup.
    pub colliders: Vec<(String, Pose)>,
}

/// Drag, air and springs of a cloth.
#[derive(Clone, Debug, PartialEq)]
pub struct ClothParameters {
    /// Name of the cloth.
    pub name: String,
    /// Linear drag of the medium on each particle (N s/m).
    pub drag: f64,
    /// The air around it, if it feels any.
    pub air: Option<Air>,
    /// Its springs, one entry per kind that it has.
    pub springs: Vec<SpringRange>,
    /// How many of its particles are pulled.
    pub pull_count: usize,
}

/// Smallest and largest numbers of the springs of a kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringRange {
    /// The kind of all of them.
    pub kind: SpringKind,
    /// Stiffness (N/m).
    pub stiffness: [f64; 2],
    /// Damping (N s/m).
    pub damping: [f64; 2],
}

/// The range of each kind among laws, in the order of the kinds.
pub(crate) fn ranges(laws: &[LawEntry]) -> Vec<SpringRange> {
    let range = |numbers: &mut dyn Iterator<Item = f64>| {
        numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    };
    let of_kind = |kind: SpringKind| {
        let laws = || laws.iter().filter(move |entry| entry.kind == kind).map(|entry| entry.law);
        laws().next().map(|_| SpringRange {
            kind,
            stiffness: range(&mut laws().map(|law| law.stiffness)),
            damping: range(&mut laws().map(|law| law.damping)),
        })
    };
    SpringKind::ALL.into_iter().filter_map(of_kind).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::SpringLaw;

    #[test]
    fn springs_are_told_by_kind_from_the_softest_to_the_stiffest() {
        let law = |kind, stiffness, damping| LawEntry { kind, law: SpringLaw { stiffness, damping } };
        let laws = [
            law(SpringKind::Stretch, 50.0, 0.25),
            law(SpringKind::Stretch, 20.0, 0.5),
            law(SpringKind::Bend, 1.0, 0.0),
        ];
        let expected = [
            SpringRange { kind: SpringKind::Stretch, stiffness: [20.0, 50.0], damping: [0.25, 0.5] },
            SpringRange { kind: SpringKind::Bend, stiffness: [1.0, 1.0], damping: [0.0, 0.0] },
        ];
        assert_eq!(ranges(&laws), expected);
    }
}

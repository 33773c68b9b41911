//! The unit of a key of a scene, as pictures of sweeps have it at their axes.

use super::scene::ROOT;
use crate::schema::{Section, ValueKind};

/// What stands in place of a unit where a key counts, or has that of a law.
const WORDS: [&str; 9] = [
    "frames",
    "iterations",
    "linear solves",
    "of the law",
    "particle",
    "particles",
    "per sub-step",
    "s times that",
    "steps",
];

/// The unit of a key by which a value is put into a scene, `N/m` of `body.cloth.springs.bend.stiffness`; empty where it has none, where
/// it is that of a law or a count, and of a key that no scene has.
pub fn unit(key: &str) -> &'static str {
    let mut section: &'static Section = &ROOT;
    let mut parts = key.split('.');
    while let Some(part) = parts.next() {
        let Some(found) = section.keys.iter().find(|known| known.name == part) else { return "" };
        section = match found.kind {
            ValueKind::Table(inner) => inner,
            ValueKind::Tables(inner, _) => {
                // One of several, by its name or its place.
                parts.next();
                inner
            }
            // A value, or one of a list by its place.
            _ if WORDS.contains(&found.unit) => return "",
            _ => return found.unit,
        };
    }
    ""
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_have_their_units_whatever_bodies_are_called() {
        for (key, expected) in [
            ("dt", "s"),
            ("gravity.1", "m/s^2"),
            ("wind", "m/s"),
            ("body.cloth.springs.bend.stiffness", "N/m"),
            ("body.stretch.springs.stretch.damping", "N s/m"),
            ("body.0.thickness", "m"),
            ("body.cloth.mass.density", "kg/m^2"),
            ("body.cloth.integrator", ""),
            ("steps", ""),
            ("body.cloth.law.quadratic_bending.stiffness", ""),
            ("body.cloth", ""),
            ("nothing", ""),
            ("body.cloth.nothing.at.all", ""),
            ("", ""),
        ] {
            assert_eq!(unit(key), expected, "{key}");
        }
    }
}

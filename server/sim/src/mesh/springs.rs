//! Springs that a mesh carries of its own: between which points, what they resist, how stiff and how long they are.

use serde::{Deserialize, Serialize};

use crate::names::names;

/// What a spring resists.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum SpringKind {
    /// Along an edge: change of length.
    Stretch,
    /// Along the diagonals of a cell, or across a pair of triangles: change of angle.
    Shear,
    /// Between particles two apart: folding.
    Bend,
}

names!(SpringKind { Stretch: "stretch", Shear: "shear", Bend: "bend" });

/// A spring that a mesh carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshSpring {
    /// The points that it joins.
    pub points: [u32; 2],
    /// What it resists.
    pub kind: SpringKind,
    /// Stiffness (N/m), 0 or more.
    pub stiffness: f64,
    /// Damping along it (N s/m), 0 or more.
    pub damping: f64,
    /// Rest length (m), above 0; none: as the mesh lies.
    pub rest_length: Option<f64>,
}

impl MeshSpring {
    /// The first of its numbers that is none: what it is, its value, and what is allowed.
    pub fn wrong_number(&self) -> Option<(&'static str, f64, &'static str)> {
        let is_wrong = |value: f64| !value.is_finite() || value < 0.0;
        let numbers = [("stiffness", self.stiffness), ("damping", self.damping)];
        if let Some((what, value)) = numbers.into_iter().find(|(_, value)| is_wrong(*value)) {
            return Some((what, value, "a finite number, 0 or more"));
        }
        let length = self.rest_length.filter(|length| is_wrong(*length) || *length == 0.0)?;
        Some(("rest length", length, "a finite number above 0, or none: as the mesh lies"))
    }
}

/// The first spring that joins what an earlier one joins, behind that one.
pub fn repeated_spring(springs: &[MeshSpring]) -> Option<[usize; 2]> {
    let ends = |(index, spring): (u32, &MeshSpring)| {
        let [a, b] = spring.points;
        ([a.min(b), a.max(b)], index)
    };
    let mut ends: Vec<([u32; 2], u32)> = (0..).zip(springs).map(ends).collect();
    ends.sort_unstable();
    let twice = ends.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    let first = twice.map(|pair| [pair[0].1, pair[1].1]).min_by_key(|[_, after]| *after);
    first.map(|pair| pair.map(|index| index as usize))
}

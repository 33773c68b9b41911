//! What is known of a mesh around a particle: how far it is at least, and which of its triangles may be the nearest one.
//!
//! Reads places (m) as the mesh sees them. What is kept holds for the mesh, whatever happens to the particle: it spares
//! questions, and changes no answer.

use super::{
    MeshSolid,
    four::WIDTH,
    nearest::Place,
    tree::{KEPT, Leaf},
};
use crate::{
    collide::shape::geometry::Nearest,
    math::{
        Pack, WithSimd,
        array::{length, minus},
        dispatch,
    },
};

/// Bytes that a particle of cloth keeps of each mesh among the colliders.
pub const NEAR_BYTES: u64 = size_of::<Near>() as u64;
/// Share of a length that is given up for rounding to binary32.
const ROUNDING: f64 = 1e-6;

/// What is known around a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near {
    /// The place (m), as the mesh sees it.
    at: [f32; 3],
    /// No point of the surface is nearer to it (m); 0 of a place inside.
    distance: f32,
    /// What is nearer to it than this (m) is one of these triangles: numbers of their leaves and places there, nearest first,
    /// and distances (m) that they have at least.
    radius: f32,
    triangles: [u32; KEPT],
    distances: [f32; KEPT],
}

/// Stands where fewer triangles are known.
const NONE: u32 = u32::MAX;

impl Default for Near {
    fn default() -> Self {
        let (triangles, distances) = ([NONE; KEPT], [0.0; KEPT]);
        Self { at: [0.0; 3], distance: 0.0, radius: 0.0, triangles, distances }
    }
}

impl Near {
    /// A distance (m) that a place (m) certainly has; below 0 where nothing is known.
    pub(in crate::collide) fn at_least(&self, place: [f64; 3]) -> f64 {
        f64::from(self.distance) - self.away(place)
    }

    fn away(&self, place: [f64; 3]) -> f64 {
        length(minus(place, self.at.map(f64::from)))
    }
}

impl MeshSolid {
    /// Signed distance (m) of a place (m) and the normal there, by the triangles that are known to be near; none where they
    /// may not have the nearest one.
    pub(in crate::collide) fn by_near(&self, place: [f64; 3], near: &Near) -> Option<Nearest> {
        let room = f64::from(near.radius) - near.away(place);
        // What is not finite is not known.
        if room.is_nan() || room <= 0.0 {
            return None;
        }
        let (leaf, found) = dispatch(Among { solid: self, near, place })?;
        (found.square < room * room).then(|| {
            let nearest = self.0.signed(leaf, found, place);
            // What is certainly outside, and not on a seam, is in no part.
            let is_alone = self.0.union.is_none() || near.at_least(place) > self.0.sides().rounding();
            if is_alone { nearest } else { self.0.united(place, leaf, nearest) }
        })
    }

    /// Looks around a place (m); gives its signed distance (m) and the normal there too. Which triangles are near is asked
    /// where the surface is nearer than `reach` (m).
    pub(in crate::collide) fn look(&self, place: [f64; 3], reach: f64) -> (Near, Nearest) {
        let nearest = self.0.at(place);
        let mut near = Near { at: place.map(|c| c as f32), ..Near::default() };
        let floor = |length: f64| ((length * (1.0 - ROUNDING)).max(0.0)) as f32;
        near.distance = floor(nearest.0 - near.away(place));
        if nearest.0.abs() < reach {
            let (kept, radius) = self.0.tree.around(near.at.map(f64::from));
            near.radius = floor(radius);
            for (k, (leaf, distance)) in kept.into_iter().flatten().enumerate() {
                near.triangles[k] = (leaf.leaf * WIDTH + leaf.lane) as u32;
                near.distances[k] = floor(distance);
            }
        }
        (near, nearest)
    }
}

/// The search among the triangles that are known to be near.
struct Among<'a> {
    solid: &'a MeshSolid,
    near: &'a Near,
    place: [f64; 3],
}

impl WithSimd<f64> for Among<'_> {
    const WIDE_BINARY64: bool = false;
    type Output = Option<(Leaf, Place)>;

    #[inline(always)]
    fn run<P: Pack<Number = f64>>(self) -> Self::Output {
        let Self { solid, near, place } = self;
        let away = near.away(place);
        let (mut best, mut found) = ((f64::INFINITY, u32::MAX), None);
        for (triangle, distance) in near.triangles.iter().zip(near.distances) {
            let least = (f64::from(distance) - away).max(0.0);
            if *triangle == NONE || least * least > best.0 {
                break;
            }
            let leaf = Leaf { leaf: *triangle as usize / WIDTH, lane: *triangle as usize % WIDTH };
            let triangles = &solid.0.tree.leaves[leaf.leaf];
            let on = triangles.place(leaf.lane, place);
            let this = (on.square, triangles.number[leaf.lane]);
            if this < best {
                (best, found) = (this, Some((leaf, on)));
            }
        }
        found
    }
}

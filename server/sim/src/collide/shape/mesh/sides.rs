//! On which side of a surface a point is: told by the pseudonormal of what is nearest to it, a face, an edge or a corner.
//!
//! Reads the nearest triangle and the place on it; writes the signed distance (m) and the unit normal there.

use super::{
    nearest::{On, Place, Triangles},
    normals::Normals,
    tree::{Leaf, Tree},
};
use crate::{
    collide::shape::geometry::Nearest,
    math::array::{dot, length},
};

/// Distance from an edge or a corner, over the size of the mesh, below which its direction is rounding.
const NO_WAY: f64 = 1e-9;
/// 1 less the cosine of the angle below which a direction is that of the pseudonormal.
const SAME_WAY: f64 = 1e-14;

/// What tells sides of a surface.
#[derive(Clone, Copy)]
pub(super) struct Sides<'a> {
    pub(super) triangles: &'a [[u32; 3]],
    pub(super) normals: &'a Normals,
    /// Largest coordinate (m).
    pub(super) size: f64,
}

impl Sides<'_> {
    /// Signed distance (m) of a point (m) from the surface at time 0, and the normal there, where the nearest triangle is known.
    pub(super) fn at(&self, tree: &Tree, found: Leaf, p: [f64; 3]) -> Nearest {
        let triangles = &tree.leaves[found.leaf];
        self.signed(triangles, found.lane, triangles.place(found.lane, p))
    }

    /// The same where the nearest place is known too.
    #[inline]
    pub(super) fn signed(&self, leaf: &Triangles, lane: usize, place: Place) -> Nearest {
        let Self { triangles, normals, size } = self;
        let number = leaf.number[lane] as usize;
        let pseudonormal = match place.on {
            On::Face => return (place.height, leaf.normal(lane)),
            On::Edge(k) => normals.edges[number][k],
            On::Corner(k) => normals.corners[triangles[number][k] as usize],
        };
        let (length, share) = (length(place.way), dot(place.way, pseudonormal));
        let is_told = length > NO_WAY * size && share.abs() < (1.0 - SAME_WAY) * length;
        if !is_told && pseudonormal != [0.0; 3] {
            return (if share < 0.0 { -length } else { length }, pseudonormal);
        }
        let side = if share < 0.0 { -1.0 } else { 1.0 };
        let direction = if length > 0.0 { place.way.map(|c| side * c / length) } else { leaf.normal(lane) };
        (side * length, direction)
    }
}

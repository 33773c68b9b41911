//! On which side of a surface a point is: told by the pseudonormal of what is nearest to it, a face, an edge or a corner.
//!
//! Reads the nearest triangle and the place on it; writes the signed distance (m) and the unit normal there. Near crossings of a
//! surface with itself, winding numbers tell the side.

use super::{
    crossed::Crossed,
    nearest::{On, Place, Triangles},
    normals::Normals,
    tree::{Leaf, Mesh, Tree},
};
use crate::{
    collide::shape::geometry::Nearest,
    math::array::{dot, length},
};

/// Distance from an edge or a corner, over the size of the mesh, below which its direction is rounding.
const NO_WAY: f64 = 1e-9;
/// 1 less the cosine of the angle below which a direction is that of the pseudonormal.
pub(super) const SAME_WAY: f64 = 1e-14;

/// What tells sides of a surface.
#[derive(Clone, Copy)]
pub(super) struct Sides<'a> {
    pub(super) mesh: Mesh<'a>,
    pub(super) normals: &'a Normals,
    /// Largest coordinate (m).
    pub(super) size: f64,
    /// What is known of parts that pass through themselves.
    pub(super) crossed: Option<&'a Crossed>,
}

impl Sides<'_> {
    /// Distance (m) from an edge or a corner below which its direction is rounding.
    pub(super) fn rounding(&self) -> f64 {
        NO_WAY * self.size
    }

    /// Signed distance (m) of a point (m) from the surface at time 0, and the normal there, where the nearest triangle is known.
    pub(super) fn at(&self, tree: &Tree, found: Leaf, p: [f64; 3]) -> Nearest {
        let triangles = &tree.leaves[found.leaf];
        self.signed(triangles, found.lane, triangles.place(found.lane, p), p)
    }

    /// The same where the nearest place is known too.
    #[inline]
    pub(super) fn signed(&self, leaf: &Triangles, lane: usize, place: Place, p: [f64; 3]) -> Nearest {
        let told = self.told(leaf, lane, place);
        match self.crossed {
            None => told,
            Some(crossed) => crossed.put_right(self.mesh, self.size, leaf.number[lane], (p, told)),
        }
    }

    /// What the pseudonormal tells.
    #[inline]
    fn told(&self, leaf: &Triangles, lane: usize, place: Place) -> Nearest {
        let Self { mesh, normals, .. } = self;
        let number = leaf.number[lane] as usize;
        let pseudonormal = match place.on {
            On::Face => return (place.height, leaf.normal(lane)),
            On::Edge(k) => normals.edges[number][k],
            On::Corner(k) => normals.corners[mesh.triangles[number][k] as usize],
        };
        let (length, share) = (length(place.way), dot(place.way, pseudonormal));
        let is_told = length > self.rounding() && share.abs() < (1.0 - SAME_WAY) * length;
        if !is_told && pseudonormal != [0.0; 3] {
            return (if share < 0.0 { -length } else { length }, pseudonormal);
        }
        let side = if share < 0.0 { -1.0 } else { 1.0 };
        let direction = if length > 0.0 { place.way.map(|c| side * c / length) } else { leaf.normal(lane) };
        (side * length, direction)
    }
}

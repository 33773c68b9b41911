//! The solid within a closed surface of triangles: its signed distance, from the nearest triangle.
//!
//! Reads points (m) and triangles turned outwards. Everything is binary64, and a distance follows from the mesh and the
//! point alone. Which side a point is on is told by the pseudonormal of what is nearest: a face, an edge or a corner. Of
//! several parts that no edge joins, the solid is the union.

mod normals;
mod four;
mod nearest;
mod boxes;
mod tree;
mod sides;
mod shells;
mod buried;
mod united;
mod depth;
mod near;
#[cfg(test)]
mod sample;
#[cfg(test)]
mod tests;

use std::{fmt, sync::Arc};

use serde::{Deserialize, Serialize};

pub(in crate::collide) use self::near::Near;
pub use self::{
    near::NEAR_BYTES,
    shells::{Shell, Shells},
};

use self::{
    nearest::Place,
    normals::Normals,
    shells::Apart,
    sides::Sides,
    tree::{Leaf, Tree},
    united::Union,
};
use super::geometry::{Nearest, Probe, SignedDistance, is_finite};
use crate::math::array::{cross, dot, length, minus};

/// A solid whose surface is a closed mesh of triangles, and the point (m) about which it turns. Copies share the surface.
#[derive(Clone, Serialize, Deserialize)]
#[serde(try_from = "Parts", into = "Parts")]
pub struct MeshSolid(Arc<Surface>, [f64; 3]);

/// What a solid is made of, and what is made of that once.
struct Surface {
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    normals: Normals,
    tree: Tree,
    /// What is known of its parts, where it has several.
    union: Option<Union>,
    /// Largest coordinate (m).
    size: f64,
    /// Twice the depth (m) of its deepest point.
    thickness: f64,
}

/// A solid as it is sent: whoever gets it builds the rest again.
#[derive(Serialize, Deserialize)]
struct Parts {
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    origin: [f64; 3],
}

impl TryFrom<Parts> for MeshSolid {
    type Error = String;

    fn try_from(Parts { points, triangles, origin }: Parts) -> Result<Self, String> {
        Ok(Self::new(points, triangles)?.with_origin(origin))
    }
}

impl From<MeshSolid> for Parts {
    fn from(MeshSolid(surface, origin): MeshSolid) -> Self {
        Self { points: surface.points.clone(), triangles: surface.triangles.clone(), origin }
    }
}

impl PartialEq for MeshSolid {
    fn eq(&self, other: &Self) -> bool {
        let is_same = Arc::ptr_eq(&self.0, &other.0)
            || (self.0.triangles == other.0.triangles && self.0.points == other.0.points);
        is_same && self.1 == other.1
    }
}

impl fmt::Debug for MeshSolid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "MeshSolid({} points, {} triangles)", self.0.points.len(), self.0.triangles.len())
    }
}

impl MeshSolid {
    /// The solid within a closed surface: points (m) at time 0, and triangles whose corners turn to the left as they are
    /// seen from outside. A point may be a corner of none. Parts that no edge joins may touch and overlap; a part within another
    /// that is turned inside out is a hole. Parts that share a point get one each.
    ///
    /// # Errors
    /// What is wrong: no triangles, a point that is not there or not finite, an edge without exactly two triangles
    /// that run along it in opposite directions, no volume, a part that is turned the wrong way.
    pub fn new(points: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Self, String> {
        if let Some((i, point)) = points.iter().enumerate().find(|(_, point)| !is_finite(**point)) {
            return Err(format!("point {i} is {point:?}: finite coordinates are needed"));
        }
        if triangles.is_empty() {
            return Err("it has no triangles: a closed surface is needed".to_owned());
        }
        let is_out = |t: &[u32; 3]| t.iter().any(|i| *i as usize >= points.len());
        if let Some((i, triangle)) = triangles.iter().enumerate().find(|(_, t)| is_out(t)) {
            return Err(format!("triangle {i} is {triangle:?}: points 0 to {} are there", points.len() - 1));
        }
        let apart = Apart::new(points, triangles)?;
        let volume = volume(&apart.points, &apart.triangles);
        if volume.is_nan() || volume <= 0.0 {
            return Err(format!(
                "its volume is {volume} m³: triangles turned outwards around a volume are needed"
            ));
        }
        let shells = Shells::of(&apart)?;
        if let Some(Shell { first, .. }) = shells.list.iter().find(|shell| shell.is_turned) {
            return Err(format!(
                "its part of triangle {first} is turned the wrong way: outwards around a solid, inwards around a hole in \
                 one"
            ));
        }

        let solids = shells.solids();
        let (tree, union) = if solids.len() == 1 {
            (Tree::over(apart.mesh(), solids, 1).0, None)
        } else {
            let (triangles, normals) = (&apart.triangles[..], &apart.normals);
            let sides = Sides { triangles, normals, size: apart.size() };
            let (tree, union) = Union::new(apart.mesh(), sides, &solids);
            (tree, Some(union))
        };
        let size = tree.bounds().as_flattened().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let cubes = depth::MOST_CUBES / union.as_ref().map_or(1, Union::cost);
        let Apart { points, triangles, normals, .. } = apart;
        let mut surface = Surface { points, triangles, normals, tree, union, size, thickness: 0.0 };
        surface.thickness = 2.0 * depth::deepest(surface.tree.bounds(), cubes, |p| -surface.at(p).0);
        Ok(Self(Arc::new(surface), [0.0; 3]))
    }

    /// The same about another point (m) than the world's origin: where its transform puts the origin of its file.
    #[must_use]
    pub fn with_origin(self, origin: [f64; 3]) -> Self {
        Self(self.0, origin)
    }

    /// The point (m) at time 0 about which it turns.
    pub fn origin(&self) -> [f64; 3] {
        self.1
    }

    /// Its points (m) at time 0.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.0.points
    }

    /// Its triangles: indices of points.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.0.triangles
    }

    /// Bytes that a solid of so many points and triangles takes.
    pub const fn bytes(points: u64, triangles: u64) -> u64 {
        let per_triangle = 12 + 24 + 72 + Tree::bytes_per_leaf() / 4;
        48 * points + per_triangle * triangles
    }
}

impl Surface {
    /// Signed distance (m) of a point (m) from the surface at time 0, and the normal there.
    fn at(&self, p: [f64; 3]) -> Nearest {
        let Some((_, found)) = self.tree.nearest(p) else { return (f64::NAN, [0.0, 1.0, 0.0]) };
        let nearest = self.signed(found, self.tree.leaves[found.leaf].place(found.lane, p));
        self.united(p, found, nearest)
    }

    /// That of the nearest triangle alone, where the place on it is known.
    fn signed(&self, found: Leaf, place: Place) -> Nearest {
        self.sides().signed(&self.tree.leaves[found.leaf], found.lane, place)
    }

    /// What that of the nearest triangle means where there are several parts.
    fn united(&self, p: [f64; 3], found: Leaf, nearest: Nearest) -> Nearest {
        let Some(union) = &self.union else { return nearest };
        let triangle = self.tree.leaves[found.leaf].number[found.lane];
        union.at(&self.tree, self.sides(), p, (triangle, nearest))
    }

    fn sides(&self) -> Sides<'_> {
        Sides { triangles: &self.triangles, normals: &self.normals, size: self.size }
    }
}

impl SignedDistance for MeshSolid {
    fn invalid(&self) -> Option<String> {
        // What would be wrong is found where it is made.
        None
    }

    fn nearest(&self, probe: Probe) -> Nearest {
        self.0.at(probe.relative_to([0.0; 3]))
    }

    fn reference(&self) -> [f64; 3] {
        self.1
    }

    fn thickness(&self) -> f64 {
        self.0.thickness
    }

    fn reach(&self) -> f64 {
        self.points().iter().map(|point| length(minus(*point, self.1))).fold(0.0, f64::max)
    }

    fn has_creases(&self) -> bool {
        true
    }
}

/// Volume (m³) within a closed surface by the divergence theorem, with a point of it as the apex of tetrahedra.
fn volume(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let apex = points[triangles[0][0] as usize];
    let of_one = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|i| minus(points[i as usize], apex));
        dot(a, cross(b, c))
    };
    triangles.iter().map(of_one).sum::<f64>() / 6.0
}

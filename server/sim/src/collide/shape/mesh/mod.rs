//! The solid within a closed surface of triangles: its signed distance, from the nearest triangle.
//!
//! Reads points (m) and triangles turned outwards. Everything is binary64, and a distance follows from the mesh and the
//! point alone. Which side a point is on is told by the pseudonormal of what is nearest: a face, an edge or a corner. Of
//! several parts that no edge joins, the solid is the union. Where a part passes through itself, winding numbers tell sides.

mod normals;
mod four;
mod nearest;
mod boxes;
mod tree;
mod bundles;
mod crossings;
mod crossed;
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
    crossings::{FirstCrossing, SelfCrossings},
    near::NEAR_BYTES,
    shells::{Shell, Shells},
};

use self::{
    boxes::ROOT,
    crossed::{Crossed, Looked},
    nearest::Place,
    normals::Normals,
    shells::Apart,
    sides::{SAME_WAY, Sides},
    tree::{Leaf, Mesh, Tree},
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
    /// How often parts pass through themselves, and what is known of those that do.
    crossings: SelfCrossings,
    crossed: Option<Crossed>,
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
    /// that is turned inside out is a hole. Parts that share a point get one each. A part may pass through itself: what it goes
    /// round is inside.
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
        Ok(Self(Arc::new(Surface::new(apart, &shells)), [0.0; 3]))
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

    /// How often its parts pass through themselves.
    pub fn crossings(&self) -> SelfCrossings {
        self.0.crossings
    }

    /// Bytes that a solid of so many points and triangles takes.
    pub const fn bytes(points: u64, triangles: u64) -> u64 {
        // Also of one part, which is not known before: the part of each triangle.
        let per_triangle = 12 + 24 + 72 + Tree::bytes_per_leaf() / 4 + Union::BYTES_PER_TRIANGLE;
        48 * points + per_triangle * triangles
    }
}

impl Surface {
    /// Of parts that are turned as they should be.
    fn new(apart: Apart, shells: &Shells) -> Self {
        let mesh = apart.mesh();
        let Looked { crossings, crossed, hidden } = Looked::new(mesh, apart.size(), &shells.skins());
        let mut solids = shells.solids();
        if !hidden.is_empty() {
            let mut is_hidden = vec![false; mesh.triangles.len()];
            for t in &hidden {
                is_hidden[*t as usize] = true;
            }
            for solid in &mut solids {
                solid.retain(|t| !is_hidden[*t as usize]);
            }
        }

        let (tree, union) = if solids.len() == 1 {
            (Tree::over(mesh, solids, 1).0, None)
        } else {
            let sides =
                Sides { mesh, normals: &apart.normals, size: apart.size(), crossed: crossed.as_ref() };
            let (tree, union) = Union::new(mesh, sides, &solids);
            (tree, Some(union))
        };
        let size = tree.bounds().as_flattened().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let dearer = crossed.as_ref().map_or(1, |crossed| crossed.cost(mesh));
        let cubes = depth::MOST_CUBES / union.as_ref().map_or(1, Union::cost) / dearer;
        let Apart { points, triangles, normals, .. } = apart;
        let thickness = 0.0;
        let mut surface =
            Self { points, triangles, normals, tree, union, crossings, crossed, size, thickness };
        surface.thickness = 2.0 * depth::deepest(surface.tree.bounds(), cubes, |p| -surface.at(p).0);
        surface
    }

    /// Signed distance (m) of a point (m) from the surface at time 0, and the normal there.
    fn at(&self, p: [f64; 3]) -> Nearest {
        let Some((_, found)) = self.tree.nearest(p) else { return (f64::NAN, [0.0, 1.0, 0.0]) };
        let nearest = self.signed(found, self.tree.leaves[found.leaf].place(found.lane, p), p);
        self.united(p, found, nearest)
    }

    /// That of the nearest triangle alone, where the place on it is known.
    fn signed(&self, found: Leaf, place: Place, p: [f64; 3]) -> Nearest {
        self.sides().signed(&self.tree.leaves[found.leaf], found.lane, place, p)
    }

    /// What that of the nearest triangle means where there are several parts.
    fn united(&self, p: [f64; 3], found: Leaf, nearest: Nearest) -> Nearest {
        let Some(union) = &self.union else { return nearest };
        let (distance, normal) = union.at(&self.tree, self.sides(), p, (found, nearest));
        if distance.abs() > self.sides().rounding() {
            return (distance, normal);
        }
        (distance, self.only_normal(p).unwrap_or(normal))
    }

    /// The normal of all that may be seen within rounding of a point (m), where it lies in one plane: along the seam of two parts
    /// whose faces are beside each other, where each part for itself has an edge.
    fn only_normal(&self, p: [f64; 3]) -> Option<[f64; 3]> {
        let within = self.sides().rounding();
        let mut first = None;
        let is_bent = self.tree.any_within(ROOT, p, within * within, |t| {
            let normal = self.normals.faces[t as usize];
            dot(*first.get_or_insert(normal), normal) < 1.0 - SAME_WAY
        });
        first.filter(|_| !is_bent)
    }

    fn sides(&self) -> Sides<'_> {
        let Self { points, triangles, normals, .. } = self;
        let mesh = Mesh { points, triangles, faces: &normals.faces };
        Sides { mesh, normals, size: self.size, crossed: self.crossed.as_ref() }
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

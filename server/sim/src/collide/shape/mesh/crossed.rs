//! Sides of parts that pass through themselves: inside is what a part goes round, however often and whichever way.
//!
//! Where no other triangle of the part is near, a look at both sides of a triangle tells once what it is: surface, where
//! pseudonormals tell sides, or within the solid, where it is no surface. Near crossings each point (m) is asked for its winding
//! number, which of a closed surface is whole: A. Jacobson et al., "Robust inside-outside segmentation using generalized winding
//! numbers", ACM TOG 32 (2013).

use super::{
    boxes::NONE,
    bundles::Bundles,
    crossings::{CrossedPart, Search, SelfCrossings},
    tree::Mesh,
};
use crate::{
    collide::shape::geometry::Nearest,
    math::array::{cross, length, minus},
    mesh::Groups,
};

/// How far from a surface its sides are looked at, over the size of the mesh: what is nearer counts as on it.
const ROOM: f64 = 1e-12;
/// Triangles that a winding number may look at without being dear.
const CHEAP: usize = 256;

/// A part of a surface, which no edge joins to others.
pub(super) struct Skin {
    pub(super) triangles: Vec<u32>,
    /// Whether it is around a hole.
    pub(super) is_hole: bool,
}

/// Parts that pass through themselves.
#[derive(Clone, Debug)]
pub(super) struct Crossed {
    /// Of each triangle, which of these parts is asked for the side of a point to which it is nearest; [`NONE`]: pseudonormals
    /// tell.
    of_triangle: Vec<u32>,
    parts: Vec<Asked>,
}

/// A part that is asked for winding numbers.
#[derive(Clone, Debug)]
struct Asked {
    bundles: Bundles,
    is_hole: bool,
}

/// What was found of the parts of a surface.
pub(super) struct Looked {
    pub(super) crossings: SelfCrossings,
    /// None where no part passes through itself.
    pub(super) crossed: Option<Crossed>,
    /// Triangles with the solid, or with air, on both of their sides; none where no part passes through itself.
    pub(super) hidden: Vec<u32>,
}

impl Looked {
    /// Of the parts of a surface with a largest coordinate (m).
    pub(super) fn new(mesh: Mesh<'_>, size: f64, skins: &[Skin]) -> Self {
        let mut search = Search::new(mesh);
        let mut crossed = Crossed { of_triangle: Vec::new(), parts: Vec::new() };
        let mut hidden = Vec::new();
        for skin in skins {
            let Some(found) = search.part(&skin.triangles) else { continue };
            crossed.of_triangle.resize(mesh.triangles.len(), NONE);
            hidden.extend(crossed.add(mesh, size, skin, found));
        }
        let crossed = (!crossed.parts.is_empty()).then_some(crossed);
        Self { crossings: search.found, crossed, hidden }
    }
}

impl Crossed {
    /// Adds a part; gives those of its triangles that are no surface.
    fn add(&mut self, mesh: Mesh<'_>, size: f64, skin: &Skin, found: CrossedPart) -> Vec<u32> {
        let number = self.parts.len() as u32;
        let is_reached = |t: u32| {
            let mut corners = mesh.triangles[t as usize].iter();
            !found.is_whole || corners.any(|corner| found.reached.binary_search(corner).is_ok())
        };
        let (reached, clear): (Vec<u32>, Vec<u32>) =
            skin.triangles.iter().copied().partition(|t| is_reached(*t));
        let asked = Asked { bundles: found.bundles, is_hole: skin.is_hole };

        let (mut hidden, mut of_part) = (Vec::new(), reached);
        for patch in patches(mesh, &clear) {
            match asked.kind(mesh, size, &patch) {
                Kind::Surface => {}
                Kind::Hidden => hidden.extend(patch),
                Kind::Unclear => of_part.extend(patch),
            }
        }
        for t in of_part {
            self.of_triangle[t as usize] = number;
        }
        self.parts.push(asked);
        hidden
    }

    /// What the distance (m) and the normal mean that pseudonormals tell of a point (m), where this triangle is nearest to it: the
    /// same, or with its sides changed.
    pub(super) fn put_right(
        &self,
        mesh: Mesh<'_>,
        size: f64,
        t: u32,
        (p, told): ([f64; 3], Nearest),
    ) -> Nearest {
        let Some(asked) = self.parts.get(self.of_triangle[t as usize] as usize) else { return told };
        let (distance, normal) = told;
        let room = ROOM * size;
        let is_wrong = if distance.abs() > room {
            (distance < 0.0) != asked.is_solid(mesh, p)
        } else {
            // The point is on the surface: both sides of this are looked at.
            let at = |height: f64| [0, 1, 2].map(|c| p[c] + (height - distance) * normal[c]);
            asked.is_solid(mesh, at(room)) && (distance >= 0.0 || !asked.is_solid(mesh, at(-room)))
        };
        if is_wrong { (-distance, normal.map(|c| -c)) } else { told }
    }

    /// By how much fewer points may be looked at in the time that a part without crossings takes.
    pub(super) fn cost(&self, mesh: Mesh<'_>) -> usize {
        let dearest = self.parts.iter().map(|part| part.bundles.cost(mesh)).max();
        1 + dearest.unwrap_or(0) / CHEAP
    }
}

/// What triangles are that nothing crosses.
enum Kind {
    /// Outside is where their normals lead, and the solid behind them.
    Surface,
    /// Both of their sides are within the solid, or within a hole.
    Hidden,
    /// Their normals lead into the solid, or it is not known where they lead.
    Unclear,
}

impl Asked {
    /// Whether a point (m) is within the solid, as far as this part tells.
    fn is_solid(&self, mesh: Mesh<'_>, p: [f64; 3]) -> bool {
        (self.bundles.winding(mesh, p) == 0) == self.is_hole
    }

    /// What triangles are that edges join and nothing crosses: the largest of them is looked at.
    fn kind(&self, mesh: Mesh<'_>, size: f64, patch: &[u32]) -> Kind {
        let area = |t: &u32| {
            let [a, b, c] = mesh.corners(*t);
            length(cross(minus(b, a), minus(c, a)))
        };
        let Some(largest) = patch.iter().max_by(|a, b| area(a).total_cmp(&area(b))) else {
            return Kind::Unclear;
        };
        let ([a, b, c], normal) = (mesh.corners(*largest), mesh.faces[*largest as usize]);
        let is_solid = |way: f64| {
            let p = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0 + way * normal[k]);
            self.is_solid(mesh, p)
        };
        match [is_solid(ROOM * size), is_solid(-ROOM * size)] {
            [false, true] => Kind::Surface,
            [outer, inner] if outer == inner && inner != self.is_hole => Kind::Hidden,
            _ => Kind::Unclear,
        }
    }
}

/// Triangles in groups that edges join.
fn patches(mesh: Mesh<'_>, triangles: &[u32]) -> Vec<Vec<u32>> {
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * triangles.len());
    for (place, t) in (0_u32..).zip(triangles) {
        let [a, b, c] = mesh.triangles[*t as usize];
        sides.extend([[a, b], [b, c], [c, a]].map(|[from, to]| ([from.min(to), from.max(to)], place)));
    }
    sides.sort_unstable();
    let mut joined = Groups::new(triangles.len());
    for pair in sides.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        joined.join([pair[0].1, pair[1].1]);
    }
    let (mut patches, mut numbers) = (Vec::<Vec<u32>>::new(), vec![0; triangles.len()]);
    for (place, t) in (0_u32..).zip(triangles) {
        let first = joined.first(place);
        if first == place {
            numbers[place as usize] = patches.len();
            patches.push(Vec::new());
        }
        patches[numbers[first as usize]].push(*t);
    }
    patches
}

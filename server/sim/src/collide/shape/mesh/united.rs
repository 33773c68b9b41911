//! The union of solids that may overlap or touch: each is a part with its own tree, and what lies wholly within another part is
//! no surface of the union.
//!
//! Reads the triangles of each part; tells, of the nearest triangle that may be seen from outside, what it means for a point (m).
//! Outside, the distance is that to this triangle. Inside, no point of the union's surface is nearer than it, nor nearer
//! than the surface of a part that holds the point: the depth is the larger of both.

use super::{
    boxes::{Bounds, Boxes, NONE},
    buried::Buried,
    sides::Sides,
    tree::{Leaf, Mesh, Tree},
};
use crate::collide::shape::geometry::Nearest;

/// Parts that are looked through one after the other to find how deep a point is, as long as this costs little.
const FEW_PARTS: usize = 64;

/// What is known of the parts of a solid that has several.
#[derive(Clone, Debug)]
pub(super) struct Union {
    /// Part of each triangle.
    pub(super) of_triangle: Vec<u32>,
    parts: Vec<Part>,
    /// Boxes around those parts that others may overlap.
    pub(super) boxes: Boxes,
    /// How many parts these are.
    near_others: usize,
}

/// A part of the union, with its trees in the forest.
#[derive(Clone, Copy, Debug)]
struct Part {
    /// Where its trees begin: that over what may be seen and that over what is within other parts, or one of them alone.
    roots: [u32; 2],
    /// Whether some of it is within other parts.
    is_partly_buried: bool,
}

impl Union {
    /// What is kept of each triangle.
    pub(super) const BYTES_PER_TRIANGLE: u64 = size_of::<u32>() as u64;

    /// Of the triangles of each part: the tree that shows what may be seen of the union, and what is to be known of the parts.
    pub(super) fn new(mesh: Mesh<'_>, sides: Sides<'_>, parts: &[Vec<u32>]) -> (Tree, Self) {
        let mut of_triangle = vec![0; mesh.triangles.len()];
        for (part, triangles) in (0_u32..).zip(parts) {
            for t in triangles {
                of_triangle[*t as usize] = part;
            }
        }
        let Buried { near_others, mut triangles } = Buried::new(mesh, sides, parts);
        if parts.iter().flatten().all(|t| triangles[*t as usize]) {
            triangles.fill(false);
        }
        let bounds: Vec<(u32, Bounds)> = (0_u32..)
            .zip(parts)
            .filter(|(part, _)| near_others[*part as usize])
            .map(|(part, triangles)| (part, mesh.around(triangles)))
            .collect();

        // What may be seen stands before what may not.
        let (mut groups, mut of_part) = (Vec::new(), vec![[None; 2]; parts.len()]);
        let mut shown = 0;
        for (place, is_hidden) in [false, true].into_iter().enumerate() {
            for (part, of) in parts.iter().zip(&mut of_part) {
                let group = part.iter().copied().filter(|t| triangles[*t as usize] == is_hidden);
                let group: Vec<u32> = group.collect();
                if !group.is_empty() {
                    of[place] = Some(groups.len());
                    groups.push(group);
                }
            }
            if !is_hidden {
                shown = groups.len();
            }
        }
        let (tree, roots) = Tree::over(mesh, groups, shown);
        let root = |group: Option<usize>| group.map(|group| roots[group]);
        let part = |[seen, hidden]: [Option<usize>; 2]| {
            let roots = match [root(seen), root(hidden)] {
                [Some(seen), hidden] => [seen, hidden.unwrap_or(NONE)],
                [None, hidden] => [hidden.unwrap_or(NONE), NONE],
            };
            Part { roots, is_partly_buried: hidden.is_some() }
        };
        let parts = of_part.into_iter().map(part).collect();
        let boxes = Boxes::new(&bounds);
        (tree, Self { of_triangle, parts, boxes, near_others: bounds.len() })
    }

    /// Signed distance (m) of a point (m) from the union and the normal there, from the triangle that is nearest of those that may
    /// be seen, and the signed distance and the normal there.
    pub(super) fn at(
        &self,
        tree: &Tree,
        sides: Sides<'_>,
        p: [f64; 3],
        (found, nearest): (Leaf, Nearest),
    ) -> Nearest {
        let own = self.of_triangle[tree.leaves[found.leaf].number[found.lane] as usize];
        let mut deepest: Option<Nearest> = None;
        self.boxes.around(p, |number| {
            let part = self.parts[number as usize];
            if number == own && !part.is_partly_buried {
                return;
            }
            let nearest = if number == own {
                // None of its triangles that may be seen is nearer than this one: only the others are asked.
                tree.nearest_of(found, part.roots[1], p)
            } else {
                tree.nearest_below(part.roots, p)
            };
            let Some((_, leaf)) = nearest else { return };
            let here = sides.at(tree, leaf, p);
            if here.0 < deepest.map_or(0.0, |deepest| deepest.0) {
                deepest = Some(here);
            }
        });
        let Some(deepest) = deepest else { return nearest };
        let (distance, normal) = nearest;
        // Seen from another part that holds the point, the way out leads there.
        let seen = if distance < 0.0 { nearest } else { (-distance, normal.map(|c| -c)) };
        if deepest.0 < seen.0 { deepest } else { seen }
    }

    /// By how much fewer points may be looked at in the time that one part takes.
    pub(super) fn cost(&self) -> usize {
        1 + self.near_others / FEW_PARTS
    }
}

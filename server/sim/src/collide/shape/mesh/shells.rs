//! The shells of a surface, which no edge joins: which of them are around solids, which around holes in these, and which are
//! turned the wrong way.
//!
//! Reads points (m) and triangles; how often the shells around it go round a shell, each by its turn, tells what it is: A.
//! Jacobson et al., "Robust inside-outside segmentation using generalized winding numbers", ACM TOG 32 (2013). Shells that only
//! overlap are not around each other.

use super::{
    boxes::{Bounds, NONE},
    bundles::Bundles,
    crossed::Skin,
    crossings::{Search, SelfCrossings},
    normals::Normals,
    sides::Sides,
    tree::{Mesh, Tree},
};
use crate::{
    interrupt,
    math::array::{cross, dot, minus},
    mesh::Groups,
};

/// Rounding of a place, over the size of the mesh.
const ROUNDING: f64 = 1e-12;
/// How much more volume a shell has than what is within it.
const MORE: f64 = 1.0 + 1e-9;
/// Pairs of shells of which the box of one holds that of the other, at most.
const MOST_PAIRS: usize = 1 << 20;

/// A shell: a closed surface that no edge joins to others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shell {
    /// Its first triangle.
    pub first: u32,
    /// Whether its triangles are turned the wrong way: around a solid inwards, around a hole outwards.
    pub is_turned: bool,
    /// The shell around the solid in which it is a hole; none where it is around a solid.
    pub hole_in: Option<u32>,
    /// Whether it is within a solid and around a hole in it, and so no surface at all: what is turned round must be without it.
    pub is_inner: bool,
}

/// The shells of a surface, in the order of their first triangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shells {
    /// Shell of each triangle.
    pub of_triangle: Vec<u32>,
    /// What each is.
    pub list: Vec<Shell>,
}

/// A surface of which no point is in two shells.
pub(super) struct Apart {
    pub(super) points: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) normals: Normals,
    of_triangle: Vec<u32>,
    pieces: Vec<Piece>,
}

/// What a shell is made of.
struct Piece {
    triangles: Vec<u32>,
    /// Volume (m³) by the divergence theorem: below 0 where triangles are turned inwards.
    volume: f64,
    bounds: Bounds,
}

impl Piece {
    /// How often it goes round what is within it.
    fn turn(&self) -> i64 {
        if self.volume < 0.0 { -1 } else { 1 }
    }
}

impl Shells {
    /// Of a closed surface: points (m) and triangles.
    ///
    /// # Errors
    /// When an edge has not exactly two triangles that run along it in opposite directions, or too many shells are near each other.
    pub fn new(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Self, String> {
        Self::of(&Apart::new(points.to_vec(), triangles.to_vec())?)
    }

    /// # Errors
    /// When too many shells are near each other.
    pub(super) fn of(apart: &Apart) -> Result<Self, String> {
        let pieces = &apart.pieces;
        let around = containers(apart)?;
        let turns =
            |around: &Vec<u32>| around.iter().map(|outer| pieces[*outer as usize].turn()).sum::<i64>();
        // How often those around a shell go round it. Where they do, and it does not take that back, it is within a solid.
        let turns: Vec<i64> = around.iter().map(turns).collect();
        let size = |shell: u32| pieces[shell as usize].volume.abs();
        let mut list = Vec::with_capacity(pieces.len());
        for ((piece, around), turn) in pieces.iter().zip(&around).zip(&turns) {
            let is_hole = *turn != 0 && turn + piece.turn() == 0;
            let bounding = around.iter().copied().filter(|outer| turns[*outer as usize] == 0);
            let innermost = bounding.min_by(|a, b| size(*a).total_cmp(&size(*b)));
            let hole_in = innermost.filter(|_| is_hole);
            let is_turned = (piece.turn() < 0) == hole_in.is_none();
            list.push(Shell { first: piece.triangles[0], is_turned, hole_in, is_inner: false });
        }
        for (hole, around) in around.iter().enumerate() {
            for outer in around.iter().map(|outer| *outer as usize) {
                let is_of_hole = list[hole].hole_in.is_some() && list[outer].hole_in.is_none();
                list[outer].is_inner |= is_of_hole && turns[outer] != 0;
            }
        }
        Ok(Self { of_triangle: apart.of_triangle.clone(), list })
    }

    /// The shells with their triangles.
    pub(super) fn skins(&self) -> Vec<Skin> {
        let skin = |shell: &Shell| Skin { triangles: Vec::new(), is_hole: shell.hole_in.is_some() };
        let mut skins: Vec<Skin> = self.list.iter().map(skin).collect();
        for (t, shell) in (0_u32..).zip(&self.of_triangle) {
            skins[*shell as usize].triangles.push(t);
        }
        skins
    }

    /// The triangles of each solid, those around its holes with them.
    pub(super) fn solids(&self) -> Vec<Vec<u32>> {
        let mut number = vec![0; self.list.len()];
        let mut solids = Vec::new();
        for (number, shell) in number.iter_mut().zip(&self.list) {
            if shell.hole_in.is_none() {
                *number = solids.len();
                solids.push(Vec::new());
            }
        }
        for (t, shell) in (0_u32..).zip(&self.of_triangle) {
            let around = self.list[*shell as usize].hole_in.unwrap_or(*shell);
            solids[number[around as usize]].push(t);
        }
        solids
    }
}

impl SelfCrossings {
    /// Of the shells of a closed surface: points (m) and triangles.
    ///
    /// # Errors
    /// When an edge has not exactly two triangles that run along it in opposite directions.
    pub fn new(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Self, String> {
        let apart = Apart::new(points.to_vec(), triangles.to_vec())?;
        let mut search = Search::new(apart.mesh());
        for piece in &apart.pieces {
            search.part(&piece.triangles);
        }
        Ok(search.found)
    }
}

impl Apart {
    /// # Errors
    /// When an edge has not exactly two triangles that run along it in opposite directions.
    pub(super) fn new(points: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Self, String> {
        let (normals, joined) = Normals::new(&points, &triangles)?;
        let (of_triangle, pieces) = pieces(&points, &triangles, joined);
        let mut apart = Self { points, triangles, normals, of_triangle, pieces };
        if apart.pieces.len() > 1 && apart.part_points() {
            apart.normals = Normals::new(&apart.points, &apart.triangles)?.0;
        }
        Ok(apart)
    }

    /// Gives each shell points of its own; whether two had one together.
    fn part_points(&mut self) -> bool {
        let mut owner = vec![NONE; self.points.len()];
        let mut copies = std::collections::BTreeMap::new();
        for (corners, shell) in self.triangles.iter_mut().zip(&self.of_triangle) {
            for corner in corners {
                let point = *corner as usize;
                if owner[point] == NONE {
                    owner[point] = *shell;
                } else if owner[point] != *shell {
                    *corner = *copies.entry((*corner, *shell)).or_insert_with(|| {
                        self.points.push(self.points[point]);
                        self.points.len() as u32 - 1
                    });
                }
            }
        }
        !copies.is_empty()
    }

    /// Largest coordinate (m).
    pub(super) fn size(&self) -> f64 {
        let coordinates = self.pieces.iter().flat_map(|piece| piece.bounds).flatten();
        coordinates.fold(0.0, |most: f64, c| most.max(c.abs()))
    }

    /// What trees are made over.
    pub(super) fn mesh(&self) -> Mesh<'_> {
        Mesh { points: &self.points, triangles: &self.triangles, faces: &self.normals.faces }
    }
}

/// The shell of each triangle, and the shells.
fn pieces(points: &[[f64; 3]], triangles: &[[u32; 3]], mut joined: Groups) -> (Vec<u32>, Vec<Piece>) {
    let (mut pieces, mut of_triangle) = (Vec::<Piece>::new(), Vec::<u32>::with_capacity(triangles.len()));
    for (t, corners) in (0_u32..).zip(triangles) {
        let corners = corners.map(|i| points[i as usize]);
        let first = joined.first(t);
        let shell = if first == t {
            pieces.push(Piece { triangles: Vec::new(), volume: 0.0, bounds: [corners[0]; 2] });
            pieces.len() as u32 - 1
        } else {
            of_triangle[first as usize]
        };
        of_triangle.push(shell);
        let piece = &mut pieces[shell as usize];
        let apex = piece.triangles.first().map_or(corners[0], |t| points[triangles[*t as usize][0] as usize]);
        let [a, b, c] = corners.map(|p| minus(p, apex));
        piece.volume += dot(a, cross(b, c)) / 6.0;
        piece.triangles.push(t);
        for p in corners {
            let [low, high] = piece.bounds;
            piece.bounds = [[0, 1, 2].map(|c| low[c].min(p[c])), [0, 1, 2].map(|c| high[c].max(p[c]))];
        }
    }
    (of_triangle, pieces)
}

/// The shells around each shell.
fn containers(apart: &Apart) -> Result<Vec<Vec<u32>>, String> {
    let Apart { points, triangles, normals, pieces, .. } = apart;
    let mesh = apart.mesh();
    let mut around = vec![Vec::new(); pieces.len()];
    if pieces.len() == 1 {
        return Ok(around);
    }
    let size = apart.size();
    let pairs = boxes_within_boxes(pieces, ROUNDING * size)?;
    if pairs.is_empty() {
        return Ok(around);
    }
    let groups = pieces.iter().map(|piece| piece.triangles.clone()).collect();
    let (tree, roots) = Tree::over(mesh, groups, pieces.len());
    let sides = Sides { mesh, normals, size, crossed: None };
    let mut bundles: Vec<Option<Bundles>> = vec![None; pieces.len()];
    for [inner, outer] in pairs {
        interrupt::point();
        let of_outer = bundles[outer as usize]
            .get_or_insert_with(|| Bundles::new(mesh, &pieces[outer as usize].triangles));
        let turn = if pieces[outer as usize].turn() < 0 { -1.0 } else { 1.0 };
        let is_within = |p: [f64; 3]| {
            let found = tree.nearest_below([roots[outer as usize], NONE], p);
            let is_told = |leaf| turn * sides.at(&tree, leaf, p).0 <= ROUNDING * size;
            // Within a shell that passes through itself, pseudonormals may not tell.
            found.is_some_and(|(_, leaf)| is_told(leaf)) || of_outer.winding(mesh, p) != 0
        };
        let corners = pieces[inner as usize].triangles.iter().flat_map(|t| triangles[*t as usize]);
        if corners.map(|i| points[i as usize]).all(is_within) {
            around[inner as usize].push(outer);
        }
    }
    Ok(around)
}

/// Shells of which the box of the second holds that of the first, to rounding (m), and which has more volume.
fn boxes_within_boxes(pieces: &[Piece], rounding: f64) -> Result<Vec<[u32; 2]>, String> {
    let piece = |shell: u32| &pieces[shell as usize];
    let low = |shell: u32| piece(shell).bounds[0][0];
    let mut order: Vec<u32> = (0_u32..).take(pieces.len()).collect();
    order.sort_by(|a, b| low(*a).total_cmp(&low(*b)));
    let holds = |outer: &Piece, inner: &Piece| {
        let ([low, high], [from, to]) = (outer.bounds, inner.bounds);
        outer.volume.abs() > MORE * inner.volume.abs()
            && (0..3).all(|c| low[c] <= from[c] + rounding && high[c] >= to[c] - rounding)
    };
    let mut pairs = Vec::new();
    for inner in (0_u32..).take(pieces.len()) {
        interrupt::point();
        let before = order.iter().take_while(|outer| low(**outer) <= low(inner) + rounding);
        let outer = before.filter(|outer| holds(piece(**outer), piece(inner)));
        pairs.extend(outer.map(|outer| [inner, *outer]));
        if pairs.len() > MOST_PAIRS {
            return Err(format!(
                "has more than {MOST_PAIRS} pairs of parts of which one is within the box around the other: so many are not \
                 told apart"
            ));
        }
    }
    Ok(pairs)
}

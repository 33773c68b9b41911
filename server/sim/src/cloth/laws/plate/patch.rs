//! A part of a mesh, laid out in the plane around one of its triangles.
//!
//! Triangles are laid beside each other as they are at rest. One is left out whose edges would come out too long or too short,
//! as where the mesh closes around a tube or is curved in both directions: the patch ends there.

use std::collections::{BTreeMap, BTreeSet};

use crate::{
    interrupt,
    math::array::{cross, dot, length, minus},
};

/// Triangles of a patch, at most.
const MOST: usize = 2048;
/// Change of an edge as it is laid, at most, in lengths at rest.
const DISTORTED: f64 = 0.1;
/// Rings inside those that are held that are told apart.
pub(super) const RINGS: usize = 4;

/// The triangles of a mesh, each with the points across its edges, and which are next to each other.
pub(super) struct Neighbourhood<'a> {
    points: &'a [[f64; 3]],
    around: &'a [[u32; 6]],
    /// Across each edge the triangle there, in the order of the corners opposite to them.
    pub(super) neighbours: Vec<[Option<u32>; 3]>,
}

/// A part of the mesh.
#[derive(Default)]
pub(super) struct Patch {
    /// Where its points lie (m), by their number in the patch.
    pub(super) places: Vec<[f64; 2]>,
    /// Triangles that have all their neighbours in the patch, with the points across their edges.
    pub(super) whole: Vec<[u32; 6]>,
    /// Of each of these, how many rings of points it is away from those that are held: 0 to [`RINGS`].
    pub(super) depths: Vec<usize>,
    /// Whether a point belongs to a triangle whose neighbours are not all there, or is across an edge of it.
    pub(super) is_held: Vec<bool>,
    /// Triangles of the patch, by their number in the mesh.
    pub(super) triangles: Vec<u32>,
    /// Of each particle that is laid its number in the patch.
    numbers: BTreeMap<u32, u32>,
    /// The triangles once more, to look them up.
    inside: BTreeSet<u32>,
}

impl<'a> Neighbourhood<'a> {
    /// Looks which triangles are next to each other.
    pub(super) fn new(points: &'a [[f64; 3]], around: &'a [[u32; 6]]) -> Self {
        let mut sides = Vec::with_capacity(3 * around.len());
        for (triangle, particles) in (0_u32..).zip(around) {
            interrupt::point();
            for k in 0..3 {
                let (p, q) = (particles[(k + 1) % 3], particles[(k + 2) % 3]);
                // Across an edge of one triangle alone, or of more than two, the corner stands again.
                if particles[3 + k] != particles[k] {
                    sides.push(([p.min(q), p.max(q)], triangle, k));
                }
            }
        }
        sides.sort_unstable();
        let mut neighbours = vec![[None; 3]; around.len()];
        for pair in sides.as_chunks::<2>().0 {
            let [(_, one, k), (_, other, l)] = *pair;
            neighbours[one as usize][k] = Some(other);
            neighbours[other as usize][l] = Some(one);
        }
        Self { points, around, neighbours }
    }

    /// The patch around a triangle.
    pub(super) fn patch(&self, middle: u32) -> Patch {
        let mut patch = Patch::default();
        let [a, b, c] = self.corners(middle);
        let [x, y, z] = [a, b, c].map(|particle| self.points[particle as usize]);
        let (along, away) = (minus(y, x), minus(z, x));
        let long = length(along);
        patch.place(a, [0.0; 2]);
        patch.place(b, [long, 0.0]);
        patch.place(c, [dot(away, along) / long, length(cross(along, away)) / long]);
        patch.add(middle);

        let mut next = 0;
        while let Some(&triangle) = patch.triangles.get(next) {
            interrupt::point();
            next += 1;
            for k in 0..3 {
                let Some(other) = self.neighbours[triangle as usize][k] else { continue };
                let has_room = patch.triangles.len() < MOST && !patch.inside.contains(&other);
                if has_room && self.lay(&mut patch, &self.around[triangle as usize], k) {
                    patch.add(other);
                }
            }
        }
        self.finish(&mut patch);
        patch
    }

    fn corners(&self, triangle: u32) -> [u32; 3] {
        let [a, b, c, ..] = self.around[triangle as usize];
        [a, b, c]
    }

    /// Lays the neighbour across an edge of a triangle of the patch; false where it does not fit.
    fn lay(&self, patch: &mut Patch, particles: &[u32; 6], k: usize) -> bool {
        let [apex, from, to, point] = [k, (k + 1) % 3, (k + 2) % 3, 3 + k].map(|corner| particles[corner]);
        let [start, end, there] = [from, to, point].map(|particle| self.points[particle as usize]);
        let [inside, first, second] = [apex, from, to].map(|particle| patch.place_of(particle));
        let (Some(inside), Some(first), Some(second)) = (inside, first, second) else { return false };

        // Away from the triangle: to that side of the edge on which its corner is not.
        let (edge, away) = (minus(end, start), minus(there, start));
        let (square, [u, v]) = (dot(edge, edge), [second[0] - first[0], second[1] - first[1]]);
        let side = u * (inside[1] - first[1]) - v * (inside[0] - first[0]);
        let sign = if side > 0.0 { -1.0 } else { 1.0 };
        let (share, height) = (dot(away, edge) / square, sign * length(cross(away, edge)) / square);
        let laid = patch
            .place_of(point)
            .unwrap_or([first[0] + share * u - height * v, first[1] + share * v + height * u]);

        let is_beyond = sign * (u * (laid[1] - first[1]) - v * (laid[0] - first[0])) > 0.0;
        let fits = |[p, q]: [[f64; 2]; 2], at_rest: f64| {
            let is = ((p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2)).sqrt();
            (is - at_rest).abs() <= DISTORTED * at_rest
        };
        let is_laid = is_beyond
            && fits([first, second], length(edge))
            && fits([first, laid], length(away))
            && fits([second, laid], length(minus(there, end)));
        if is_laid {
            patch.place(point, laid);
        }
        is_laid
    }

    /// Tells which triangles have all their neighbours, which points are held, and how deep inside the triangles are.
    fn finish(&self, patch: &mut Patch) {
        patch.is_held = vec![false; patch.places.len()];
        for triangle in patch.triangles.clone() {
            let neighbours = self.neighbours[triangle as usize];
            let particles = self.around[triangle as usize];
            if neighbours.iter().all(|other| other.is_some_and(|other| patch.inside.contains(&other))) {
                let numbers = particles.map(|particle| patch.numbers[&particle]);
                patch.whole.push(numbers);
            } else {
                // What is across its edges too: all elements of a point that may move are in the patch.
                for number in particles.iter().filter_map(|particle| patch.numbers.get(particle)) {
                    patch.is_held[*number as usize] = true;
                }
            }
        }

        let mut depths: Vec<usize> = patch.is_held.iter().map(|held| if *held { 0 } else { RINGS }).collect();
        for ring in 1..RINGS {
            for [a, b, c, ..] in &patch.whole {
                let corners = [a, b, c].map(|corner| *corner as usize);
                if corners.iter().any(|corner| depths[*corner] == ring - 1) {
                    for corner in corners {
                        depths[corner] = depths[corner].min(ring);
                    }
                }
            }
        }
        let depth = |[a, b, c, ..]: &[u32; 6]| {
            let of = |corner: &u32| depths[*corner as usize];
            of(a).min(of(b)).min(of(c))
        };
        patch.depths = patch.whole.iter().map(depth).collect();
    }
}

impl Patch {
    fn place_of(&self, particle: u32) -> Option<[f64; 2]> {
        self.numbers.get(&particle).map(|number| self.places[*number as usize])
    }

    /// Puts a particle where it is to lie, unless it lies somewhere.
    fn place(&mut self, particle: u32, place: [f64; 2]) {
        let number = self.places.len() as u32;
        if *self.numbers.entry(particle).or_insert(number) == number {
            self.places.push(place);
        }
    }

    fn add(&mut self, triangle: u32) {
        self.inside.insert(triangle);
        self.triangles.push(triangle);
    }
}

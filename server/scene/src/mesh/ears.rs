//! Ear clipping: a polygon in space becomes triangles that turn as it does, and that use each of its corners.
//!
//! Which way corners turn is told by products and sums alone, about the normal of the polygon, so that the triangles
//! are the same on every platform.

use nappe_sim::math::array::{cross, dot, length, minus};

/// Square of the sine of an angle below which three points stand on a line.
const STRAIGHT: f64 = 1e-24;
/// Share of its size by which a corner of a flat polygon may be off its mean plane.
const FLAT: f64 = 0.01;
/// Share of the square of its size below which a polygon has no area.
const NO_AREA: f64 = 1e-12;

/// A polygon, its corners numbered from 0, and the axis about which it turns left.
#[derive(Debug)]
pub(super) struct Ring<'a> {
    points: &'a [[f64; 3]],
    corners: &'a [u32],
    /// Newell's, of length 1; 0 if the polygon has none.
    normal: [f64; 3],
    /// Twice the area (m^2).
    twice_area: f64,
}

impl<'a> Ring<'a> {
    /// A polygon whose corners are indices of `points`: four or more of them.
    pub(super) fn new(points: &'a [[f64; 3]], corners: &'a [u32]) -> Self {
        let mut ring = Self { points, corners, normal: [0.0; 3], twice_area: 0.0 };
        let mut sum = [0.0; 3];
        for i in 1..corners.len() - 1 {
            let part = cross(ring.edge(0, i), ring.edge(0, i + 1));
            sum = [0, 1, 2].map(|c| sum[c] + part[c]);
        }

        ring.twice_area = length(sum);
        if ring.twice_area > 0.0 {
            ring.normal = sum.map(|c| c / ring.twice_area);
        }
        ring
    }

    fn at(&self, corner: usize) -> [f64; 3] {
        self.points[self.corners[corner] as usize]
    }

    fn edge(&self, from: usize, to: usize) -> [f64; 3] {
        minus(self.at(to), self.at(from))
    }

    /// Twice the area (m^2) of the triangle `a` `b` `c` as seen along the normal: positive where it turns as the polygon
    /// does, 0 where its corners stand on a line.
    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        let (ab, ac) = (self.edge(a, b), self.edge(a, c));
        let turn = dot(self.normal, cross(ab, ac));
        if turn * turn <= STRAIGHT * dot(ab, ab) * dot(ac, ac) { 0.0 } else { turn }
    }

    /// Largest extent along an axis (m).
    fn size(&self) -> f64 {
        let extent = |axis: usize| {
            let along = || self.corners.iter().map(|&corner| self.points[corner as usize][axis]);
            along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
        };
        (0..3).map(extent).fold(0.0, f64::max)
    }

    /// Whether the polygon has an area beside its size.
    pub(super) fn has_area(&self) -> bool {
        let size = self.size();
        self.twice_area > NO_AREA * size * size
    }

    /// Whether all corners are near the mean plane of the polygon.
    pub(super) fn is_flat(&self) -> bool {
        let heights = || (0..self.corners.len()).map(|i| dot(self.normal, self.edge(0, i)));
        let mean = heights().sum::<f64>() / self.corners.len() as f64;
        let most = FLAT * self.size();
        heights().all(|height| (height - mean).abs() <= most)
    }

    /// Whether all triangles of the fan from corner 0 turn as the polygon does, and go around that corner once at most:
    /// this fan covers the polygon then, as it does if the polygon is convex.
    pub(super) fn is_fan(&self) -> bool {
        let mut was_behind = false;
        (1..self.corners.len() - 1).all(|i| {
            let side = self.turn(0, 1, i + 1);
            let is_once = !was_behind || side < 0.0;
            was_behind |= side < 0.0;
            is_once && self.turn(0, i, i + 1) > 0.0
        })
    }
}

/// The corners that are left while ears are cut off a polygon: memory that polygons share.
#[derive(Debug, Default)]
pub(super) struct Ears {
    before: Vec<usize>,
    after: Vec<usize>,
    is_convex: Vec<bool>,
    /// Corners that may be ears: all, then the two neighbours of each that was cut off. No other can become one.
    to_try: Vec<usize>,
}

impl Ears {
    /// Appends the triangles of a polygon. False if the polygon crosses itself, or has parts without an area: nothing
    /// is appended then.
    pub(super) fn cut(&mut self, ring: &Ring<'_>, triangles: &mut Vec<[u32; 3]>) -> bool {
        let (count, start) = (ring.corners.len(), triangles.len());
        self.before.clear();
        self.before.extend((0..count).map(|i| (i + count - 1) % count));
        self.after.clear();
        self.after.extend((0..count).map(|i| (i + 1) % count));
        self.is_convex.clear();
        self.is_convex.resize(count, false);
        for corner in 0..count {
            self.set_convex(ring, corner);
        }
        self.to_try.clear();
        self.to_try.extend(0..count);

        let mut tried = 0;
        while triangles.len() < start + count - 2 {
            let Some(&tip) = self.to_try.get(tried) else {
                triangles.truncate(start);
                return false;
            };
            tried += 1;
            // A corner that was cut off follows itself.
            if self.after[tip] == tip || !self.is_ear(ring, tip) {
                continue;
            }
            let (a, c) = (self.before[tip], self.after[tip]);
            triangles.push([a, tip, c].map(|corner| ring.corners[corner]));
            (self.after[a], self.before[c], self.after[tip]) = (c, a, tip);
            for corner in [a, c] {
                self.set_convex(ring, corner);
                self.to_try.push(corner);
            }
        }
        true
    }

    fn set_convex(&mut self, ring: &Ring<'_>, corner: usize) {
        self.is_convex[corner] = ring.turn(self.before[corner], corner, self.after[corner]) > 0.0;
    }

    /// Whether the triangle of a corner and its neighbours can be cut off.
    fn is_ear(&self, ring: &Ring<'_>, tip: usize) -> bool {
        let (a, c) = (self.before[tip], self.after[tip]);
        // Two corners at one place keep a triangle without an area, so that each of them is in one.
        if ring.at(tip) == ring.at(c) {
            return true;
        }
        if !self.is_convex[tip] {
            return false;
        }

        // If any corner is in the triangle, one that is not convex is.
        let mut at = self.after[c];
        while at != a {
            if !self.is_convex[at] && self.is_in_the_way(ring, [a, tip, c], at) {
                return false;
            }
            at = self.after[at];
        }
        true
    }

    /// Whether another corner stands in the triangle or on its edge. One at the place of a neighbour, as where a hole is
    /// joined to the outline, is not in the way, and one at the tip only if an edge goes from it into the triangle.
    fn is_in_the_way(&self, ring: &Ring<'_>, [a, tip, c]: [usize; 3], other: usize) -> bool {
        let place = ring.at(other);
        if place == ring.at(a) || place == ring.at(c) {
            return false;
        }
        if place == ring.at(tip) {
            let goes_in = |to: usize| ring.turn(tip, c, to) > 0.0 && ring.turn(tip, to, a) > 0.0;
            return goes_in(self.before[other]) || goes_in(self.after[other]);
        }
        ring.turn(a, tip, other) >= 0.0 && ring.turn(tip, c, other) >= 0.0 && ring.turn(c, a, other) >= 0.0
    }
}

//! The nearest of four triangles, and the place on a triangle that is nearest to a point.
//!
//! Reads a point (m); writes squares of distances (m²), the nearest place (m) and what of the triangle it lies on. Without
//! square roots and without branches, so that four triangles are measured at once.

use crate::math::array::{dot, minus};

/// Triangles that are measured at once.
pub(super) const WIDTH: usize = 4;

type Four = [f64; WIDTH];

/// Four triangles, number by number; fewer are filled up with the last one.
#[derive(Clone, Debug)]
pub(super) struct Triangles {
    /// First corner (m), ways from it to the second and to the third.
    a: [Four; 3],
    ab: [Four; 3],
    ac: [Four; 3],
    /// Unit normal; zero without area.
    n: [Four; 3],
    /// Twice the area (m²), below 0 where there is none, so that no point is over the triangle.
    area2: Four,
    /// 1 / length² of the edges from the first corner to the second, to the third, and between these; 0 without length.
    over: [Four; 3],
    /// Numbers of the triangles in the mesh.
    pub(super) number: [u32; WIDTH],
}

impl Triangles {
    /// Of at most four triangles: each its number, its corners (m) and its unit normal.
    pub(super) fn new(parts: &[(u32, [[f64; 3]; 3], [f64; 3])]) -> Self {
        let zero = [[0.0; WIDTH]; 3];
        let mut four = Self {
            a: zero,
            ab: zero,
            ac: zero,
            n: zero,
            area2: [0.0; WIDTH],
            over: zero,
            number: [0; WIDTH],
        };
        for lane in 0..WIDTH {
            let (number, [a, b, c], normal) = parts[lane.min(parts.len() - 1)];
            let [ab, ac, bc] = [minus(b, a), minus(c, a), minus(minus(c, a), minus(b, a))];
            for k in 0..3 {
                four.a[k][lane] = a[k];
                four.ab[k][lane] = ab[k];
                four.ac[k][lane] = ac[k];
                four.n[k][lane] = normal[k];
                let square = [dot(ab, ab), dot(ac, ac), dot(bc, bc)][k];
                four.over[k][lane] = if square >= f64::MIN_POSITIVE { 1.0 / square } else { 0.0 };
            }
            let area2 = dot(crate::math::array::cross(ab, ac), normal);
            four.area2[lane] = if area2 > 0.0 { area2 } else { -1.0 };
            four.number[lane] = number;
        }
        four
    }

    /// Squares (m²) of the distances of a point (m).
    #[inline(always)]
    pub(super) fn squares(&self, p: [f64; 3]) -> Four {
        let mut squares = [0.0; WIDTH];
        for (lane, square) in squares.iter_mut().enumerate() {
            *square = self.one(lane, p).square();
        }
        squares
    }

    /// One of them as a point sees it.
    #[inline(always)]
    fn one(&self, lane: usize, p: [f64; 3]) -> Seen {
        let of = |v: &[Four; 3]| [v[0][lane], v[1][lane], v[2][lane]];
        let [a, ab, ac, n, over] = [&self.a, &self.ab, &self.ac, &self.n, &self.over].map(of);
        let bc = minus(ac, ab);
        let q = minus(p, a);
        let to_b = minus(q, ab);
        let share = |along: f64, over: f64| (along * over).max(0.0).min(1.0);
        let t = [share(dot(q, ab), over[0]), share(dot(q, ac), over[1]), share(dot(to_b, bc), over[2])];
        let beyond = |q: [f64; 3], t: f64, edge: [f64; 3]| {
            let way = [q[0] - t * edge[0], q[1] - t * edge[1], q[2] - t * edge[2]];
            dot(way, way)
        };
        let edges = [beyond(q, t[0], ab), beyond(q, t[1], ac), beyond(to_b, t[2], bc)];
        // Twice the areas of the triangles that the point's foot makes with two of the edges.
        let w = [q[1] * n[2] - q[2] * n[1], q[2] * n[0] - q[0] * n[2], q[0] * n[1] - q[1] * n[0]];
        let (s, r) = (dot(ab, w), -dot(ac, w));
        let is_over = s >= 0.0 && r >= 0.0 && s + r <= self.area2[lane];
        Seen { t, edges, height: dot(q, n), is_over }
    }

    /// What of a triangle is nearest to a point (m), and the way (m) from there to the point; over the triangle itself the
    /// way is along its normal, with the height as its share.
    pub(super) fn place(&self, lane: usize, p: [f64; 3]) -> Place {
        let seen = self.one(lane, p);
        if seen.is_over {
            return Place { on: On::Face, way: [0.0; 3], height: seen.height };
        }
        let nearest = (1..3).fold(0, |best, k| if seen.edges[k] < seen.edges[best] { k } else { best });
        let t = seen.t[nearest];
        let [from, to] = [[0, 1], [0, 2], [1, 2]][nearest];
        // Edges go from each corner to the next: that between the first and the third is the last one.
        let on = if t <= 0.0 {
            On::Corner(from)
        } else if t >= 1.0 {
            On::Corner(to)
        } else {
            On::Edge([0, 2, 1][nearest])
        };
        let of = |v: &[Four; 3]| [v[0][lane], v[1][lane], v[2][lane]];
        let [a, ab, ac] = [&self.a, &self.ab, &self.ac].map(of);
        let q = minus(p, a);
        let (q, edge) = [(q, ab), (q, ac), (minus(q, ab), minus(ac, ab))][nearest];
        Place { on, way: [0, 1, 2].map(|c| q[c] - t * edge[c]), height: seen.height }
    }

    /// Unit normal of a triangle.
    pub(super) fn normal(&self, lane: usize) -> [f64; 3] {
        [0, 1, 2].map(|c| self.n[c][lane])
    }
}

/// A triangle as a point sees it.
#[derive(Clone, Copy)]
struct Seen {
    /// Shares of the edges at which they are nearest, and squares (m²) of the distances from there.
    t: [f64; 3],
    edges: [f64; 3],
    /// Height (m) over the plane.
    height: f64,
    /// Whether the point's foot on the plane lies within the triangle.
    is_over: bool,
}

impl Seen {
    #[inline(always)]
    fn square(self) -> f64 {
        let [x, y, z] = self.edges;
        let beside = if x < y { x } else { y };
        let beside = if beside < z { beside } else { z };
        if self.is_over { self.height * self.height } else { beside }
    }
}

/// What of a triangle is nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum On {
    Face,
    /// From corner k to the next one.
    Edge(usize),
    Corner(usize),
}

/// The place of a triangle that is nearest to a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) on: On,
    /// The way (m) from there to the point; not said of a face.
    pub(super) way: [f64; 3],
    /// The point's height (m) over the plane of the triangle.
    pub(super) height: f64,
}

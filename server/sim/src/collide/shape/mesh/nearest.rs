//! The nearest of four triangles, and the place on a triangle that is nearest to a point.
//!
//! Reads a point (m); writes squares of distances (m²), the nearest place (m) and what of the triangle it lies on. Without
//! square roots and without branches, so that four triangles are measured at once.

use super::four::{Four, WIDTH};
use crate::math::array::{cross, dot, minus};

/// A triangle of a mesh.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub(super) number: u32,
    /// Places (m).
    pub(super) corners: [[f64; 3]; 3],
    /// Of length 1, or zero of a triangle without area.
    pub(super) normal: [f64; 3],
}

/// A vector of each of four.
type Vectors = [Four; 3];

/// Four triangles, number by number; fewer are filled up with the last one.
#[derive(Clone, Debug, Default)]
pub(super) struct Triangles {
    /// First corner (m), ways from it to the second and to the third.
    a: Vectors,
    ab: Vectors,
    ac: Vectors,
    /// Unit normal; zero without area.
    n: Vectors,
    /// Twice the area (m²), below 0 where there is none, so that no point is over the triangle.
    area2: Four,
    /// 1 / length² of the edges from the first corner to the second, to the third, and between these; 0 without length.
    over: [Four; 3],
    /// Numbers of the triangles in the mesh.
    pub(super) number: [u32; WIDTH],
}

impl Triangles {
    /// Of one to four triangles.
    pub(super) fn new(parts: &[Part]) -> Self {
        let mut four = Self::default();
        for lane in 0..WIDTH {
            let Part { number, corners: [a, b, c], normal } = parts[lane.min(parts.len() - 1)];
            let [ab, ac, bc] = [minus(b, a), minus(c, a), minus(minus(c, a), minus(b, a))];
            for k in 0..3 {
                four.a[k].0[lane] = a[k];
                four.ab[k].0[lane] = ab[k];
                four.ac[k].0[lane] = ac[k];
                four.n[k].0[lane] = normal[k];
                let square = [dot(ab, ab), dot(ac, ac), dot(bc, bc)][k];
                four.over[k].0[lane] = if square >= f64::MIN_POSITIVE { 1.0 / square } else { 0.0 };
            }
            let area2 = dot(cross(ab, ac), normal);
            four.area2.0[lane] = if area2 > 0.0 { area2 } else { -1.0 };
            four.number[lane] = number;
        }
        four
    }

    /// Squares (m²) of the distances of a point (m).
    #[inline(always)]
    pub(super) fn squares(&self, p: [f64; 3]) -> [f64; WIDTH] {
        let Seen { edges: [x, y, z], height, over, .. } = self.seen(p);
        over.choose(height * height, x.min(y).min(z)).0
    }

    /// All of them as a point (m) sees them.
    #[inline(always)]
    fn seen(&self, p: [f64; 3]) -> Seen {
        let Self { a, ab, ac, n, area2, over, .. } = self;
        let apart = |p: Vectors, q: &Vectors| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
        let along = |p: &Vectors, q: &Vectors| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
        let q = apart([Four::all(p[0]), Four::all(p[1]), Four::all(p[2])], a);
        let (to_b, bc) = (apart(q, ab), apart(*ac, ab));
        let share = |along: Four, over: Four| (along * over).max(Four::all(0.0)).min(Four::all(1.0));
        let t =
            [share(along(&q, ab), over[0]), share(along(&q, ac), over[1]), share(along(&to_b, &bc), over[2])];
        let beyond = |q: &Vectors, t: Four, edge: &Vectors| {
            let way = [q[0] - t * edge[0], q[1] - t * edge[1], q[2] - t * edge[2]];
            along(&way, &way)
        };
        let edges = [beyond(&q, t[0], ab), beyond(&q, t[1], ac), beyond(&to_b, t[2], &bc)];
        // Twice the areas of the triangles that the point's foot makes with two of the edges.
        let w = [q[1] * n[2] - q[2] * n[1], q[2] * n[0] - q[0] * n[2], q[0] * n[1] - q[1] * n[0]];
        let (s, r) = (along(ab, &w), Four::all(0.0) - along(ac, &w));
        Seen { t, edges, height: along(&q, n), over: s.min(r).min(*area2 - (s + r)) }
    }

    /// What of a triangle is nearest to a point (m).
    #[inline(always)]
    pub(super) fn place(&self, lane: usize, p: [f64; 3]) -> Place {
        let Seen { t, edges, height, over } = self.seen(p);
        let height = height.0[lane];
        if over.0[lane] >= 0.0 {
            return Place { on: On::Face, way: [0.0; 3], height, square: height * height };
        }
        let edges = edges.map(|edge| edge.0[lane]);
        let nearest = (1..3).fold(0, |best, k| if edges[k] < edges[best] { k } else { best });
        let t = t[nearest].0[lane];
        let [from, to] = [[0, 1], [0, 2], [1, 2]][nearest];
        // Edges go from each corner to the next: that between the first and the third is the last one.
        let on = if t <= 0.0 {
            On::Corner(from)
        } else if t >= 1.0 {
            On::Corner(to)
        } else {
            On::Edge([0, 2, 1][nearest])
        };
        let of = |v: &Vectors| [v[0].0[lane], v[1].0[lane], v[2].0[lane]];
        let [a, ab, ac] = [&self.a, &self.ab, &self.ac].map(of);
        let q = minus(p, a);
        let (q, edge) = [(q, ab), (q, ac), (minus(q, ab), minus(ac, ab))][nearest];
        let way = [q[0] - t * edge[0], q[1] - t * edge[1], q[2] - t * edge[2]];
        Place { on, way, height, square: edges[nearest] }
    }

    /// Unit normal of a triangle.
    pub(super) fn normal(&self, lane: usize) -> [f64; 3] {
        [0, 1, 2].map(|c| self.n[c].0[lane])
    }
}

/// Four triangles as a point sees them.
#[derive(Clone, Copy)]
struct Seen {
    /// Shares of the edges at which they are nearest, and squares (m²) of the distances from there.
    t: [Four; 3],
    edges: [Four; 3],
    /// Height (m) over the plane.
    height: Four,
    /// 0 or more where the point's foot on the plane lies within the triangle.
    over: Four,
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
    /// Square (m²) of its distance, with the bits of [`Triangles::squares`].
    pub(super) square: f64,
}

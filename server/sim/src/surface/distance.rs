//! The closest points of a vertex and a triangle, and of two edges, in binary64.
//!
//! Reads four places (m); writes how the closest points are mixed of them, the way from one to the other (m) and what they
//! lie on. All is computed about the first place, so that neither is lost far from the origin of the scene. Places are
//! finite; needles, and parts without length or area, have their closest points as well.

use crate::math::Vec3;

/// Parts meet at an angle whose square of the sine is less than this: their normal is not trusted alone.
const FLAT: f64 = 1e-12;
/// Squares of sines of angles between edges that may count as parallel.
const NEARLY_PARALLEL: f64 = 1e-6;
/// Edges are parallel if, over their lengths, they come nearer to each other by less than this share of their distance.
const TILT: f64 = 1.0 / 256.0;

/// Which two parts of triangles a pair is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PairKind {
    /// A vertex and a triangle.
    VertexTriangle,
    /// Two edges.
    Edges,
}

/// Where the closest points of a pair lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inside {
    /// Inside of both: of the triangle, or of both edges.
    Both,
    /// Of a vertex and a triangle: on the edge that joins corners k and (k + 1) % 3.
    Edge(u8),
    /// Of a vertex and a triangle: on corner k.
    Corner(u8),
    /// Of two edges: on an end of one of them at least.
    Border,
}

/// The closest points of two parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// How they are mixed of the four places: weights of the first part sum to 1, of the second to -1.
    pub weights: [f64; 4],
    /// The way (m) from that of the second part to that of the first: the sum of weights times places.
    pub difference: Vec3<f64>,
    /// What they lie on.
    pub inside: Inside,
}

impl Closest {
    fn of(y: &[Vec3<f64>; 4], weights: [f64; 4], inside: Inside) -> Self {
        Self { weights, difference: mixed(y, weights), inside }
    }
}

/// The closest points of a pair: of a vertex and the corners of a triangle, or of the ends of one edge and of another.
#[inline]
pub fn closest(kind: PairKind, x: [Vec3<f64>; 4]) -> Closest {
    match kind {
        PairKind::VertexTriangle => vertex_triangle(x),
        PairKind::Edges => edge_edge(x),
    }
}

/// The closest points of a vertex (the first place) and a triangle (the others).
///
/// Where the foot of the vertex on the plane is not inside, the nearest place of the three edges is the closest one
/// (C. Ericson, "Real-Time Collision Detection", 2005, 5.1.5, without its order of questions, which needles mislead).
pub fn vertex_triangle(x: [Vec3<f64>; 4]) -> Closest {
    let y = about_first(&x);
    // From here on the vertex is the origin.
    let [_, a, b, c] = y;
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(&ac);
    let area2 = normal.dot(&normal);
    let foot = normal.cross(&a);
    let [s, r] = [-ac.dot(&foot), ab.dot(&foot)].map(|part| part / area2);
    let over = (s > 0.0 && r > 0.0 && s + r < 1.0)
        .then(|| Closest::of(&y, [1.0, -(1.0 - s - r), -s, -r], Inside::Both));
    if let Some(over) = over.filter(|_| area2 > FLAT * ab.dot(&ab) * ac.dot(&ac)) {
        return over;
    }

    let mut best = (f64::INFINITY, 0, 0.0);
    for (k, [from, to]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
        let t = share(&-from, &(to - from));
        let way = from * (1.0 - t) + to * t;
        let square = way.dot(&way);
        if square < best.0 {
            best = (square, k, t);
        }
    }
    let (square, k, t) = best;
    if let Some(over) = over.filter(|over| over.difference.dot(&over.difference) <= square) {
        return over;
    }
    let next = (k + 1) % 3;
    let mut weights = [1.0, 0.0, 0.0, 0.0];
    weights[1 + k] -= 1.0 - t;
    weights[1 + next] -= t;
    let inside = if t <= 0.0 {
        Inside::Corner(k as u8)
    } else if t >= 1.0 {
        Inside::Corner(next as u8)
    } else {
        Inside::Edge(k as u8)
    };
    Closest::of(&y, weights, inside)
}

/// The closest points of two edges: the first two places and the last two.
///
/// Of edges that are nearly parallel it is the middle of what they have beside each other, so that a slight turn does not
/// throw the points from one end to the other; they are then as near as any others but for 1/256 of their distance.
pub fn edge_edge(x: [Vec3<f64>; 4]) -> Closest {
    let y = about_first(&x);
    let [_, first, from, to] = y;
    let second = to - from;
    let (length2, other2) = (first.dot(&first), second.dot(&second));
    let normal = first.cross(&second);
    let square = normal.dot(&normal);
    let moment = normal.cross(&from);
    let [s, t] = [second.dot(&moment), first.dot(&moment)].map(|part| part / square);
    let within = |share: f64| share > 0.0 && share < 1.0;
    let across = (within(s) && within(t)).then(|| Closest::of(&y, between(s, t), Inside::Both));
    let is_slanted = square > NEARLY_PARALLEL * length2 * other2;
    if let Some(across) = across.filter(|_| is_slanted) {
        return across;
    }

    // An end of one and the nearest place of the other.
    let ends = [
        [0.0, share(&-from, &second)],
        [1.0, share(&(first - from), &second)],
        [share(&from, &first), 0.0],
        [share(&to, &first), 1.0],
    ];
    let ends = ends.map(|[s, t]| Closest::of(&y, between(s, t), Inside::Border));
    let square_of = |closest: &Closest| closest.difference.dot(&closest.difference);
    let nearer = |a: Closest, b: Closest| if square_of(&b) < square_of(&a) { b } else { a };
    let best = ends.into_iter().fold(across.unwrap_or(ends[0]), nearer);
    let is_level = square < TILT * TILT * square_of(&best) * length2.min(other2);
    if is_slanted || !is_level {
        return best;
    }
    middle(&y).unwrap_or(best)
}

/// The middle of what two nearly parallel edges have beside each other; nothing where that is no length.
fn middle(y: &[Vec3<f64>; 4]) -> Option<Closest> {
    let [_, first, from, to] = *y;
    let second = to - from;
    let other2 = second.dot(&second);
    let along = |end: Vec3<f64>| second.dot(&(end - from)) / other2;
    let [start, end] = [along(Vec3::zeros()), along(first)];
    let (low, high) = (start.min(end).max(0.0), start.max(end).min(1.0));
    let t = 0.5 * (low + high);
    let s = share(&(from + second * t), &first);
    let is_inside = low < high && s > 0.0 && s < 1.0;
    is_inside.then(|| Closest::of(y, between(s, t), Inside::Both))
}

/// Weights of the place at a share of the first edge and of that at a share of the second.
fn between(s: f64, t: f64) -> [f64; 4] {
    [1.0 - s, s, -(1.0 - t), -t]
}

/// At which share of an edge the place is that is nearest to a point, seen from the edge's start; 0 without length.
fn share(point: &Vec3<f64>, edge: &Vec3<f64>) -> f64 {
    let square = edge.dot(edge);
    if square > 0.0 { (edge.dot(point) / square).clamp(0.0, 1.0) } else { 0.0 }
}

/// Places (m) as the first one sees them.
fn about_first(x: &[Vec3<f64>; 4]) -> [Vec3<f64>; 4] {
    x.map(|place| place - x[0])
}

/// The sum of weights times places, of which the first is the origin.
fn mixed(y: &[Vec3<f64>; 4], weights: [f64; 4]) -> Vec3<f64> {
    y[1] * weights[1] + y[2] * weights[2] + y[3] * weights[3]
}

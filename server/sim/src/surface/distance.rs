//! The closest points of a vertex and a triangle, and of two edges, in binary64.
//!
//! Reads four places (m); writes how the closest points are mixed of them, the way from one to the other (m) and what they
//! lie on. All is computed about the first place, so that neither is lost far from the origin of the scene. Places are
//! finite; needles, and parts without length or area, have their closest points as well.

use crate::math::Vec3;

/// Of triangles whose square of the sine at the first corner is less than this the normal is not trusted alone.
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
    /// Two edges that have no particle in common.
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
    let mut best = across.unwrap_or_else(|| Closest::of(&y, between(ends[0][0], ends[0][1]), Inside::Border));
    for [s, t] in ends {
        let end = Closest::of(&y, between(s, t), Inside::Border);
        if end.difference.norm_squared() < best.difference.norm_squared() {
            best = end;
        }
    }
    let is_level = square < TILT * TILT * best.difference.norm_squared() * length2.min(other2);
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
#[inline(always)]
fn about_first([x, a, b, c]: &[Vec3<f64>; 4]) -> [Vec3<f64>; 4] {
    [Vec3::zeros(), a - x, b - x, c - x]
}

/// The sum of weights times places, of which the first is the origin.
fn mixed(y: &[Vec3<f64>; 4], weights: [f64; 4]) -> Vec3<f64> {
    y[1] * weights[1] + y[2] * weights[2] + y[3] * weights[3]
}

#[cfg(test)]
mod tests {
    use super::{super::numbers::Numbers, *};

    type Places = [Vec3<f64>; 4];

    /// How many of the places are of the first part.
    fn first_part(kind: PairKind) -> usize {
        match kind {
            PairKind::VertexTriangle => 1,
            PairKind::Edges => 2,
        }
    }

    fn distance(closest: &Closest) -> f64 {
        closest.difference.norm()
    }

    /// That weights are shares of the two parts, and that no points are nearer than by `slack` of the distance: a plane
    /// across the way between them has one part on either side, as far away as that.
    fn check(kind: PairKind, x: &Places, slack: f64) -> Closest {
        let found = closest(kind, *x);
        let split = first_part(kind);
        let (first, second) = found.weights.split_at(split);
        assert!(first.iter().all(|w| (0.0..=1.0).contains(w)), "{found:?}");
        assert!(second.iter().all(|w| (-1.0..=0.0).contains(w)), "{found:?}");
        assert!((first.iter().sum::<f64>() - 1.0).abs() < 1e-14, "{found:?}");
        assert!((second.iter().sum::<f64>() + 1.0).abs() < 1e-14, "{found:?}");

        let y = x.map(|place| place - x[0]);
        let size = y.iter().map(Vec3::norm).fold(0.0, f64::max);
        let mixed = (0..4).fold(Vec3::zeros(), |sum, k| sum + y[k] * found.weights[k]);
        let n = found.difference;
        assert!((mixed - n).norm() <= 1e-15 * size, "{found:?}");
        let height = |y: &Vec3<f64>| n.dot(y);
        let above = y[..split].iter().map(height).fold(f64::INFINITY, f64::min);
        let below = y[split..].iter().map(height).fold(f64::NEG_INFINITY, f64::max);
        let least = n.dot(&n) * (1.0 - slack) - 1e-15 * size * size;
        assert!(above - below >= least, "{kind:?} {x:?}: {above} {below} {least}, {found:?}");
        found
    }

    /// The least distance of many places of the two parts.
    fn sampled(kind: PairKind, x: &Places) -> f64 {
        const STEPS: u32 = 40;
        let share = |i: u32| f64::from(i) / f64::from(STEPS);
        let mut least = f64::INFINITY;
        for (i, j) in (0..=STEPS).flat_map(|i| (0..=STEPS).map(move |j| (i, j))) {
            let (s, t) = (share(i), share(j));
            let [first, second] = match kind {
                PairKind::VertexTriangle if i + j > STEPS => continue,
                PairKind::VertexTriangle => [x[0], x[1] + (x[2] - x[1]) * s + (x[3] - x[1]) * t],
                PairKind::Edges => [x[0] + (x[1] - x[0]) * s, x[2] + (x[3] - x[2]) * t],
            };
            least = least.min((first - second).norm());
        }
        least
    }

    #[test]
    fn no_points_of_the_parts_are_nearer() {
        let mut numbers = Numbers(1);
        for i in 0..2000 {
            let mut x: Places = numbers.places();
            let small = [1e-2, 1e-5, 1e-8, 1e-11][i / 4 % 4];
            match i % 4 {
                // Two places nearly at one; a needle, or nearly parallel edges; all of it tiny.
                1 => x[3] = x[2] + numbers.place() * small,
                2 => x[3] = x[1] + (x[2] - x[0]) * numbers.next() + numbers.place() * small,
                3 => x = x.map(|place| place * small),
                _ => {}
            }
            for kind in [PairKind::VertexTriangle, PairKind::Edges] {
                let found = check(kind, &x, if kind == PairKind::Edges { 0.01 } else { 0.0 });
                if i < 200 {
                    let most = sampled(kind, &x) * (1.0 + 1.0 / 256.0) + 1e-14;
                    assert!(distance(&found) <= most, "{kind:?} {x:?}: {found:?}");
                }
            }
        }
    }

    #[test]
    fn places_over_faces_edges_and_corners_are_told_apart() {
        let triangle = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(4.0, 0.0, 0.0), Vec3::new(0.0, 4.0, 0.0)];
        let of = |p: [f64; 3]| {
            let x = [Vec3::from(p), triangle[0], triangle[1], triangle[2]];
            let found = check(PairKind::VertexTriangle, &x, 0.0);
            (found.inside, distance(&found))
        };
        assert_eq!(of([1.0, 1.0, 3.0]), (Inside::Both, 3.0));
        assert_eq!(of([1.0, 1.0, -3.0]), (Inside::Both, 3.0));
        assert_eq!(of([2.0, -3.0, 4.0]), (Inside::Edge(0), 5.0));
        assert_eq!(of([5.0, 5.0, 0.0]).0, Inside::Edge(1));
        assert_eq!(of([-3.0, 2.0, 4.0]), (Inside::Edge(2), 5.0));
        assert_eq!(of([-3.0, -4.0, 0.0]), (Inside::Corner(0), 5.0));
        assert_eq!(of([8.0, 0.0, 3.0]), (Inside::Corner(1), 5.0));
        assert_eq!(of([0.0, 8.0, 3.0]), (Inside::Corner(2), 5.0));
    }

    #[test]
    fn edges_meet_inside_or_at_an_end() {
        let of = |to: [[f64; 3]; 2]| {
            let x = [Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0), Vec3::from(to[0]), Vec3::from(to[1])];
            let found = check(PairKind::Edges, &x, 0.0);
            (found.inside, distance(&found))
        };
        assert_eq!(of([[1.0, -1.0, 3.0], [1.0, 1.0, 3.0]]), (Inside::Both, 3.0));
        assert_eq!(of([[1.0, 3.0, 4.0], [1.0, 9.0, 4.0]]), (Inside::Border, 5.0));
        assert_eq!(of([[5.0, 4.0, 0.0], [9.0, 5.0, 0.0]]), (Inside::Border, 5.0));
        assert_eq!(of([[5.0, 0.0, 0.0], [9.0, 0.0, 0.0]]), (Inside::Border, 3.0));
    }

    #[test]
    fn a_gap_of_a_nanometre_is_measured() {
        let mut numbers = Numbers(3);
        for i in 0..500 {
            let x: Places = numbers.places();
            let [ab, ac] = [x[2] - x[1], x[3] - x[1]];
            let normal = ab.cross(&ac);
            if normal.norm() < 0.1 * ab.norm() * ac.norm() {
                continue;
            }
            let gap = normal * (1e-9 / normal.norm());
            let (s, t) = (f64::from(i % 8 + 1) / 10.0, 0.1);
            // Over the inside of the triangle; and two edges of that plane, one of them lifted out of it.
            let over = [x[1] + ab * s + ac * t + gap, x[1], x[2], x[3]];
            let middle = x[1] + ab * s;
            let across = [x[1] + gap, x[2] + gap, middle - ac * t, middle + ac * (1.0 - t)];
            let expected = [[1.0, s + t - 1.0, -s, -t], [1.0 - s, s, t - 1.0, -t]];
            for (kind, x, expected) in
                [(PairKind::VertexTriangle, over, expected[0]), (PairKind::Edges, across, expected[1])]
            {
                let found = check(kind, &x, 0.0);
                assert_eq!(found.inside, Inside::Both);
                assert!((found.difference - gap).norm() < 2e-15, "{found:?}");
                let is_near = |(w, expected): (&f64, &f64)| (w - expected).abs() < 1e-8;
                assert!(found.weights.iter().zip(&expected).all(is_near), "{found:?} {expected:?}");
            }
        }
    }

    #[test]
    fn of_parallel_edges_the_middle_counts_however_they_are_turned_a_little() {
        for turn in [0.0, 1e-12, -1e-12, 1e-6, -1e-6] {
            let to = [Vec3::new(0.5, 1e-2, turn), Vec3::new(3.0, 1e-2 + turn, 0.0)];
            let x = [Vec3::zeros(), Vec3::new(1.0, 0.0, 0.0), to[0], to[1]];
            let found = check(PairKind::Edges, &x, 0.01);
            assert_eq!(found.inside, Inside::Both);
            let [_, s, _, t] = found.weights;
            assert!((s - 0.75).abs() < 1e-5 && (-t - 0.1).abs() < 1e-5, "{turn}: {found:?}");
        }
        // Edges that nearly touch are parallel only if they are so to the last bit or two.
        let to = [Vec3::new(0.0, -1e-4, 1e-9), Vec3::new(1.0, 1e-4, 1e-9)];
        let found = check(PairKind::Edges, &[Vec3::zeros(), Vec3::new(1.0, 0.0, 0.0), to[0], to[1]], 1e-6);
        assert!((distance(&found) - 1e-9).abs() < 1e-15, "{found:?}");
        assert_eq!(found.inside, Inside::Both);
    }

    #[test]
    fn a_pair_far_away_has_the_same_bits() {
        let mut numbers = Numbers(7);
        let far = Vec3::new(1e6, -3e6, 1e6);
        for kind in [PairKind::VertexTriangle, PairKind::Edges] {
            for _ in 0..500 {
                // Places that are exact there too.
                let x: Places = numbers.places();
                let x = x.map(|place| place.map(|c| (c * 65536.0).round() / 65536.0));
                assert_eq!(closest(kind, x), closest(kind, x.map(|place| place + far)));
            }
        }
    }

    #[test]
    fn parts_without_length_or_area_have_closest_points() {
        let [o, a, b] = [Vec3::zeros(), Vec3::new(1.0, 0.0, 0.0), Vec3::new(3.0, 0.0, 0.0)];
        let p = Vec3::new(2.0, 4.0, 3.0);
        for (x, expected) in [([p, o, a, b], 5.0), ([p, a, b, a], 5.0), ([p, p, p, p], 0.0)] {
            assert_eq!(distance(&check(PairKind::VertexTriangle, &x, 0.0)), expected);
        }
        for (x, expected) in [([p, p, a, b], 5.0), ([a, b, p, p], 5.0), ([o, o, a, a], 1.0), ([p; 4], 0.0)] {
            let found = check(PairKind::Edges, &x, 0.0);
            assert_eq!((distance(&found), found.inside), (expected, Inside::Border));
        }
    }
}

//! Edges that cross triangles, and how often two closed lines are linked: apart from what the program counts.
//!
//! Signs of volumes in plain binary64: a crossing by more than rounding is seen, and nothing is exact.

use std::collections::BTreeSet;

use nappe_sim::math::array::{cross, dot, length, minus};

/// Volumes, over the cube of the longest side, that count as none.
const LEVEL: f64 = 1e-12;

/// The edges of triangles, each once.
fn edges(triangles: &[[u32; 3]]) -> BTreeSet<[u32; 2]> {
    let sides = triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
    sides.map(|[a, b]| [a.min(b), a.max(b)]).collect()
}

/// Six times the volume (m³) of a tetrahedron, with its sign.
fn volume(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    dot(cross(minus(b, a), minus(c, a)), minus(d, a))
}

/// Whether a segment goes through the inside of a triangle: 1 from behind to the front, -1 the other way, 0 if it does not.
fn passes([p, q]: [[f64; 3]; 2], [a, b, c]: [[f64; 3]; 3]) -> i64 {
    let [before, after] = [volume(a, b, c, p), volume(a, b, c, q)];
    let largest = [minus(b, a), minus(c, a), minus(q, p)].map(length).into_iter().fold(0.0, f64::max);
    // What lies in the plane but for rounding is on no side of it.
    let level = LEVEL * largest * largest * largest;
    if before * after >= 0.0 || before.abs().min(after.abs()) < level {
        return 0;
    }
    let around = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    let is_inside = around.iter().all(|v| *v > 0.0) || around.iter().all(|v| *v < 0.0);
    if is_inside { after.signum() as i64 } else { 0 }
}

/// Cells of a cubic grid that the box about some points reaches.
fn cells(points: &[[f64; 3]], cell: f64) -> impl Iterator<Item = [i32; 3]> + use<> {
    let end = |c: usize, least: fn(f64, f64) -> f64| {
        points.iter().map(|point| point[c]).reduce(least).map_or(0, |x| (x / cell).floor() as i32)
    };
    let [low, high] = [[0, 1, 2].map(|c| end(c, f64::min)), [0, 1, 2].map(|c| end(c, f64::max))];
    let across = move |i: i32, j: i32| (low[2]..=high[2]).map(move |k| [i, j, k]);
    (low[0]..=high[0]).flat_map(move |i| (low[1]..=high[1]).flat_map(move |j| across(i, j)))
}

/// How many pairs there are of an edge and a triangle that cross and share no particle. Positions in m.
pub fn crossings(triangles: &[[u32; 3]], x: &[[f64; 3]]) -> u64 {
    let edges = edges(triangles);
    let ends = |edge: &[u32; 2]| edge.map(|i| x[i as usize]);
    let cell = edges.iter().map(|edge| length(minus(ends(edge)[1], ends(edge)[0]))).fold(1e-9, f64::max);
    let mut places: Vec<([i32; 3], usize)> = Vec::new();
    for (number, triangle) in triangles.iter().enumerate() {
        let corners = triangle.map(|i| x[i as usize]);
        places.extend(cells(&corners, cell).map(|place| (place, number)));
    }
    places.sort_unstable();

    let mut count = 0;
    let mut near = Vec::new();
    for edge in &edges {
        near.clear();
        for place in cells(&ends(edge), cell) {
            let first = places.partition_point(|(other, _)| *other < place);
            let here = places[first..].iter().take_while(|(other, _)| *other == place);
            near.extend(here.map(|(_, number)| *number));
        }
        near.sort_unstable();
        near.dedup();
        let crossed = near.iter().map(|number| triangles[*number]).filter(|triangle| {
            let shares = triangle.iter().any(|corner| edge.contains(corner));
            !shares && passes(ends(edge), triangle.map(|i| x[i as usize])) != 0
        });
        count += crossed.count() as u64;
    }
    count
}

/// How often two closed lines of straight pieces are linked, with its sign: how often the first one goes through triangles that
/// join each piece of the second one with a place near its middle.
pub fn linking(a: &[[f64; 3]], b: &[[f64; 3]]) -> i64 {
    // Beside its middle, where another line may go through.
    let middle =
        [0, 1, 2].map(|c| 0.2 * b[0][c] + 0.8 * b.iter().map(|point| point[c]).sum::<f64>() / b.len() as f64);
    let piece = |line: &[[f64; 3]], i: usize| [line[i], line[(i + 1) % line.len()]];
    let through = |segment: [[f64; 3]; 2]| -> i64 {
        (0..b.len()).map(|i| piece(b, i)).map(|[p, q]| passes(segment, [middle, p, q])).sum()
    };
    (0..a.len()).map(|i| through(piece(a, i))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [3, 4, 5]];

    /// A level triangle, and another one whose tip is so far (m) below its plane.
    fn pierced(depth: f64) -> [[f64; 3]; 6] {
        let [a, b, c] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        [a, b, c, [0.2, -depth, 0.2], [0.2, 1.0, 0.1], [0.2, 1.0, 0.3]]
    }

    #[test]
    fn a_tip_that_is_through_by_a_nanometre_is_seen() {
        assert_eq!(crossings(&TRIANGLES, &pierced(1e-9)), 2, "both sides of the tip");
        assert_eq!(crossings(&TRIANGLES, &pierced(-1e-9)), 0);
    }

    #[test]
    fn rings_of_a_chain_are_linked_once_and_rings_apart_are_not() {
        let ring = |shift: f64, turned: [usize; 2]| -> Vec<[f64; 3]> {
            let point = |i: u32| {
                let (sin, cos) = (0.1 + 0.3 * f64::from(i)).sin_cos();
                let mut x = [0.013, 0.007, 0.011];
                x[turned[0]] += cos + shift;
                x[turned[1]] += sin;
                x
            };
            (0..20).map(point).collect()
        };
        let first = ring(0.0, [0, 1]);
        assert_eq!(linking(&first, &ring(1.0, [0, 2])).abs(), 1);
        assert_eq!(linking(&first, &ring(3.0, [0, 2])), 0);
    }
}

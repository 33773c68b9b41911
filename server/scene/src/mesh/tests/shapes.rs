//! Simple polygons at random, in the plane: stars, tangles undone, combs, spirals, stairs, and outlines with a hole.

use std::f64::consts::TAU;

/// Numbers at random by the xorshift of Marsaglia 2003, the same on every machine.
pub(super) struct Random(pub(super) u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// A number from 0 up to 1.
    pub(super) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number of a range.
    pub(super) fn between(&mut self, low: usize, high: usize) -> usize {
        low + (self.bits() % (high - low + 1) as u64) as usize
    }
}

type Polygon = Vec<[f64; 2]>;

/// Makes polygons of about so many corners.
pub(super) type Shape = fn(&mut Random, usize) -> Polygon;

/// Every kind of shape.
pub(super) const SHAPES: [Shape; 6] = [star, untangled, comb, spiral, stairs, holed];

fn around(radius: f64, angle: f64) -> [f64; 2] {
    [radius * libm::cos(angle), radius * libm::sin(angle)]
}

fn star(random: &mut Random, count: usize) -> Polygon {
    (0..count).map(|i| around(0.05 + random.unit(), TAU * i as f64 / count as f64)).collect()
}

/// Twice the area of a triangle, positive where it turns left.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Points in any order, with the way between two edges that cross turned round until none do: it gets shorter.
fn untangled(random: &mut Random, count: usize) -> Polygon {
    let mut points: Polygon = (0..count).map(|_| [random.unit(), random.unit()]).collect();
    let crossing = |points: &Polygon| {
        let edge = |i: usize| (points[i], points[(i + 1) % count]);
        let mut pairs = (0..count).flat_map(|i| (i + 2..count).map(move |j| (i, j)));
        pairs.find(|&(i, j)| {
            let ((a, b), (c, d)) = (edge(i), edge(j));
            turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0
        })
    };
    while let Some((i, j)) = crossing(&points) {
        points[i + 1..=j].reverse();
    }
    points
}

fn comb(random: &mut Random, count: usize) -> Polygon {
    let teeth = (count / 4).max(1);
    let mut points = Vec::new();
    for tooth in 0..teeth {
        let x = 2.0 * tooth as f64;
        points.extend([[x, 0.0], [x, 5.0 + random.unit()], [x + 1.0, 5.0 + random.unit()], [x + 1.0, 0.0]]);
    }
    points.extend([[2.0 * teeth as f64 - 1.0, -1.0], [0.0, -1.0]]);
    points
}

/// Two walls that wind around each other some times.
fn spiral(random: &mut Random, count: usize) -> Polygon {
    let (half, width) = ((count / 2).max(2), 0.1 + random.unit());
    let wall = |start: f64| (0..half).map(move |i| around(start + i as f64, 0.8 * i as f64));
    wall(1.0).chain(wall(1.0 + width).rev()).collect()
}

/// Corners at whole numbers, many of which stand on a line with their neighbours.
fn stairs(_: &mut Random, count: usize) -> Polygon {
    let steps = (count / 2).max(3);
    let above = (0..steps).rev().map(|i| [i as f64, if i % 3 == 0 { 2.0 } else { 1.0 }]);
    (0..steps).map(|i| [i as f64, 0.0]).chain(above).collect()
}

/// An outline, and the way to a hole, around it and back.
fn holed(random: &mut Random, count: usize) -> Polygon {
    let half = (count / 2).max(3);
    let mut hole = star(random, half);
    hole[1..].reverse();
    let outline = |i: usize| around(3.0, TAU * i as f64 / half as f64);
    let way = hole.iter().copied().chain([hole[0]]);
    std::iter::once(outline(0)).chain(way).chain((0..half).map(outline)).collect()
}

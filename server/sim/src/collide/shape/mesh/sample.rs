//! An L-shaped prism for the tests of every shape: an inner edge, and faces of several triangles.

use super::MeshSolid;
use crate::collide::shape::sample::{MIDDLE, Sample, TURNED, along, pairs};
use crate::math::array::{dot, minus};

/// Its outline (m) across the third axis, and half its length along that.
const OUTLINE: [[f64; 2]; 6] = [[-0.8, -0.5], [0.8, -0.5], [0.8, 0.1], [0.1, 0.1], [0.1, 0.6], [-0.8, 0.6]];
const HALF: f64 = 0.45;

fn point([x, y]: [f64; 2], z: f64) -> [f64; 3] {
    along(&[(x, TURNED[0]), (y, TURNED[1]), (z, TURNED[2])])
}

impl Sample for MeshSolid {
    fn example() -> Self {
        let points = [HALF, -HALF].iter().flat_map(|z| OUTLINE.map(|at| point(at, *z))).collect();
        let mut triangles = Vec::new();
        for [a, b, c] in [[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]] {
            triangles.extend([[a, b, c], [a + 6, c + 6, b + 6]]);
        }
        for a in 0..6 {
            let b = (a + 1) % 6;
            triangles.extend([[a + 6, b + 6, b], [a + 6, b, a]]);
        }
        Self::new(points, triangles).expect("it is closed")
    }

    fn contains(&self, p: [f64; 3]) -> bool {
        let [x, y, z] = TURNED.map(|axis| dot(minus(p, MIDDLE), axis));
        let within = |low: [f64; 2], high: [f64; 2]| low[0] < x && x < high[0] && low[1] < y && y < high[1];
        z.abs() < HALF && (within(OUTLINE[0], OUTLINE[2]) || within(OUTLINE[0], OUTLINE[4]))
    }

    fn surface(&self) -> Vec<[f64; 3]> {
        let of_one = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|i| self.points()[i as usize]);
            let within = pairs(120, 120).filter(|(s, t)| s + t <= 1.0);
            let at = move |(s, t)| [0, 1, 2].map(|k| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]));
            within.map(at).collect::<Vec<_>>()
        };
        self.triangles().iter().flat_map(of_one).collect()
    }

    fn invalid_examples() -> Vec<(Self, &'static str)> {
        // None can be made.
        Vec::new()
    }
}

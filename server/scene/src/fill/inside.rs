//! Whether a point is inside a closed mesh: the winding number along a ray in +z.
//!
//! The projection along z is decided in whole numbers: coordinates are rounded to 2^-40 of the
//! mesh's extent, so that the side of an edge on which a point lies is exact, and a point on an
//! edge or below a corner is moved by an infinitesimal step in x and a smaller one in y. Each ray
//! then crosses each closed surface as often into it as out of it, whatever it meets.

use crate::mesh::Closed;

/// Steps in the extent of the mesh.
const STEPS: f64 = (1u64 << 40) as f64;
/// Entries of all bins for each triangle, at most: bins are made larger until that holds.
const ENTRIES: u64 = 16;

/// The triangles of a mesh in bins over x and y.
#[derive(Clone, Debug)]
pub(crate) struct Inside {
    low: [f64; 3],
    /// Whole steps in a metre.
    scale: f64,
    /// Projected corners in whole steps, and heights (m).
    corners: Vec<([[i64; 2]; 3], [f64; 3])>,
    /// The part of the mesh to which each of these triangles belongs.
    parts: Vec<u32>,
    /// Bins along x and y.
    side: i64,
    /// Steps of a bin.
    width: i64,
    /// Where each bin's triangles begin in `entries`.
    first: Vec<u32>,
    entries: Vec<u32>,
}

impl Inside {
    pub(super) fn new(mesh: &Closed) -> Self {
        let [low, high] = mesh.bounds();
        let extent = (high[0] - low[0]).max(high[1] - low[1]);
        let scale = STEPS / extent;
        let mut this = Self {
            low,
            scale,
            corners: Vec::with_capacity(mesh.triangles.len()),
            parts: Vec::with_capacity(mesh.triangles.len()),
            side: 1,
            width: 1,
            first: Vec::new(),
            entries: Vec::new(),
        };

        for (triangle, part) in mesh.triangles.iter().zip(&mesh.part_of) {
            let points = triangle.map(|i| mesh.points[i as usize]);
            let flat = points.map(|p| this.steps(p));
            // A triangle upright to the plane has no area there: no ray crosses it.
            if side_of(flat[0], flat[1], flat[2]) != 0 {
                this.corners.push((flat, points.map(|p| p[2])));
                this.parts.push(*part);
            }
        }

        this.fill_bins();
        this
    }

    /// Triangles that a test looks at on average.
    pub(super) fn cost(&self) -> f64 {
        self.entries.len() as f64 / (self.first.len().max(2) - 1) as f64
    }

    /// Heights (m) between which the inside lies over a rectangle of the plane; none: nowhere.
    pub(super) fn heights(&self, from: [f64; 2], to: [f64; 2]) -> Option<[f64; 2]> {
        let bins = [from, to].map(|[x, y]| self.steps([x, y, 0.0]).map(|c| c.div_euclid(self.width)));
        let [[x0, y0], [x1, y1]] = bins.map(|bin| bin.map(|c| c.clamp(0, self.side - 1)));
        let mut range: Option<[f64; 2]> = None;
        for (x, y) in (x0..=x1).flat_map(|x| (y0..=y1).map(move |y| (x, y))) {
            for &triangle in self.bin(x, y) {
                let heights = self.corners[triangle as usize].1;
                let [low, high] = range.unwrap_or([heights[0]; 2]);
                range = Some(heights.iter().fold([low, high], |[l, h], z| [l.min(*z), h.max(*z)]));
            }
        }
        range
    }

    /// Whether a point (m) is inside.
    pub(super) fn contains(&self, point: [f64; 3]) -> bool {
        let mut winding = 0;
        self.crossings(point, |_, turn| winding += turn);
        winding != 0
    }

    /// How often two parts of the mesh wind around a point (m), and how often all of it does.
    pub(super) fn windings(&self, point: [f64; 3], pair: [u32; 2]) -> [i32; 3] {
        let [mut a, mut b, mut all] = [0; 3];
        self.crossings(point, |triangle, turn| {
            let part = self.parts[triangle as usize];
            a += if part == pair[0] { turn } else { 0 };
            b += if part == pair[1] { turn } else { 0 };
            all += turn;
        });
        [a, b, all]
    }

    /// Calls `note` for the triangles below which a point (m) may lie: with 1 or -1 where its ray crosses one, else 0.
    fn crossings(&self, point: [f64; 3], mut note: impl FnMut(u32, i32)) {
        let projected = self.steps(point);
        let [x, y] = projected.map(|c| c.div_euclid(self.width));
        if !(0..self.side).contains(&x) || !(0..self.side).contains(&y) {
            return;
        }
        for &triangle in self.bin(x, y) {
            let (flat, heights) = &self.corners[triangle as usize];
            note(triangle, crossing(flat, heights, projected, point[2]));
        }
    }

    fn steps(&self, point: [f64; 3]) -> [i64; 2] {
        [0, 1].map(|c| ((point[c] - self.low[c]) * self.scale).round() as i64)
    }

    fn bin(&self, x: i64, y: i64) -> &[u32] {
        let bin = (x * self.side + y) as usize;
        &self.entries[self.first[bin] as usize..self.first[bin + 1] as usize]
    }

    /// As many bins as triangles, or fewer where triangles are large.
    fn fill_bins(&mut self) {
        let count = self.corners.len() as u64;
        self.side = (count as f64).sqrt().ceil().clamp(1.0, 4096.0) as i64;
        loop {
            self.width = (STEPS / self.side as f64).ceil() as i64 + 1;
            let entries: u64 = (0..self.corners.len()).map(|t| self.bins_of(t).count()).sum();
            if self.side == 1 || entries <= ENTRIES * count {
                break;
            }
            self.side = (self.side / 2).max(1);
        }

        let mut first = vec![0_u32; (self.side * self.side) as usize + 1];
        let bins = |t: usize| self.bins_of(t).list();
        for bin in (0..self.corners.len()).flat_map(bins) {
            first[bin + 1] += 1;
        }
        for bin in 1..first.len() {
            first[bin] += first[bin - 1];
        }
        let mut next = first.clone();
        let mut entries = vec![0; first[first.len() - 1] as usize];
        for t in 0..self.corners.len() {
            for bin in self.bins_of(t).list() {
                entries[next[bin] as usize] = t as u32;
                next[bin] += 1;
            }
        }

        (self.first, self.entries) = (first, entries);
    }

    fn bins_of(&self, triangle: usize) -> Bins {
        let flat = &self.corners[triangle].0;
        let range = |c: usize| {
            let (low, high) = flat.iter().fold((i64::MAX, i64::MIN), |(l, h), p| (l.min(p[c]), h.max(p[c])));
            [low / self.width, high / self.width]
        };
        Bins { x: range(0), y: range(1), side: self.side }
    }
}

/// A rectangle of bins, borders included.
struct Bins {
    x: [i64; 2],
    y: [i64; 2],
    side: i64,
}

impl Bins {
    fn count(&self) -> u64 {
        ((self.x[1] - self.x[0] + 1) * (self.y[1] - self.y[0] + 1)) as u64
    }

    fn list(&self) -> impl Iterator<Item = usize> + use<> {
        let (y, side) = (self.y, self.side);
        (self.x[0]..=self.x[1]).flat_map(move |x| (y[0]..=y[1]).map(move |y| (x * side + y) as usize))
    }
}

/// Twice the area of a triangle in the plane; above 0 when it turns left.
fn side_of(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i128 {
    let wide = |value: i64| i128::from(value);
    wide(b[0] - a[0]) * wide(c[1] - a[1]) - wide(b[1] - a[1]) * wide(c[0] - a[0])
}

/// On which side of an edge a point lies, never on it: the edge's ends are apart.
fn strict_side(a: [i64; 2], b: [i64; 2], projected: [i64; 2]) -> i32 {
    let sign = |value: i128| value.signum() as i32;
    // The derivatives of the side by the point's x and y break ties.
    match (sign(side_of(a, b, projected)), (a[1] - b[1]).signum(), (b[0] - a[0]).signum()) {
        (0, 0, y) => y as i32,
        (0, x, _) => x as i32,
        (side, ..) => side,
    }
}

/// 1 or -1 when the ray from a point upwards crosses a triangle, by the triangle's sense; else 0.
fn crossing(flat: &[[i64; 2]; 3], heights: &[f64; 3], projected: [i64; 2], z: f64) -> i32 {
    let [a, b, c] = *flat;
    let turn = strict_side(a, b, projected);
    if strict_side(b, c, projected) != turn || strict_side(c, a, projected) != turn {
        return 0;
    }
    let weights =
        [side_of(b, c, projected), side_of(c, a, projected), side_of(a, b, projected)].map(|w| w as f64);
    let sum: f64 = weights.iter().sum();
    let height: f64 = weights.iter().zip(heights).map(|(w, h)| w * h).sum::<f64>() / sum;
    if height > z { turn } else { 0 }
}

//! Particles on a lattice: one in each cell, in its middle or at a random position in it.
//!
//! A box is divided evenly, so that all cells have the same share of its volume. Other solids are
//! covered by cubes about their middle, and keep the particles that are inside.

use std::ops::RangeInclusive;

use nappe_sim::interrupt;

use super::{
    hash::{Sequence, Stream},
    solid::Solid,
};

/// More positions to try than the caller allows a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooMuch;

/// Positions that may still be tried: bounds the work of a filling, and the memory of one turn of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Looks {
    /// In all turns together.
    left: u64,
    /// In one turn.
    at_once: u64,
}

impl Looks {
    /// So many in one turn, and four times as many in all turns together.
    pub(super) fn new(at_once: u64) -> Self {
        Self { left: at_once.saturating_mul(4), at_once }
    }

    /// Positions that one turn may try.
    pub(super) fn at_once(self) -> u64 {
        self.at_once.min(self.left)
    }

    /// Notes that `count` positions are tried in one turn.
    ///
    /// # Errors
    /// If that is more than are left.
    pub(super) fn take(&mut self, count: u64) -> Result<(), TooMuch> {
        if count > self.at_once() {
            return Err(TooMuch);
        }
        self.left -= count;
        Ok(())
    }
}

/// Random positions on a lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jitter {
    /// Part of a cell over which its particle may lie: 0 its middle, 1 anywhere.
    pub(crate) amount: f64,
    pub(crate) seed: u32,
}

/// Cells along the axes into which a box of these edges (m) is divided, near to cubes of edge
/// `spacing` (m).
pub(super) fn divided(size: [f64; 3], spacing: f64) -> [u64; 3] {
    size.map(|edge| (edge / spacing).round().max(1.0) as u64)
}

/// Cells along the axes of which a box has `count` or a little more: the fewest too many, and the
/// most like cubes. At most twice `count`, whatever the shape, and found in as many turns.
pub(super) fn divided_for(size: [f64; 3], count: u64) -> [u64; 3] {
    let near = near_cubes(size, count);
    let mut best = (f64::INFINITY, [1, 1, count]);
    for x in near[0].clone() {
        for y in near[1].clone() {
            let cells = [x, y, count.div_ceil(x * y)];
            let edges = [0, 1, 2].map(|c| size[c] / cells[c] as f64);
            let (least, most) = edges.iter().fold((f64::MAX, 0.0_f64), |(l, m), e| (l.min(*e), m.max(*e)));
            let excess = (x * y * cells[2] - count) as f64 / count as f64;
            let cost = excess + 0.1 * (most / least - 1.0);
            if cost < best.0 && excess <= 1.0 {
                best = (cost, cells);
            }
        }
    }

    best.1
}

/// Numbers of cells to try along each axis, about those of cubes. A box much thinner than a cube along an axis
/// has one cell there, and is divided along the others alone.
fn near_cubes(size: [f64; 3], count: u64) -> [RangeInclusive<u64>; 3] {
    let mut divided = vec![0, 1, 2];
    let mut edge = cube_edge(&divided, size, count);
    while divided.len() > 1
        && let Some(thin) = divided.iter().position(|axis| size[*axis] < 0.5 * edge)
    {
        divided.remove(thin);
        edge = cube_edge(&divided, size, count);
    }

    let near = |axis: usize| {
        let wanted = size[axis] / edge;
        let whole = |cells: f64| (cells.max(1.0) as u64).min(count);
        whole((0.7 * wanted).floor())..=whole((1.4 * wanted).ceil())
    };
    [0, 1, 2].map(|axis| match divided[..] {
        [only] if only == axis => count..=count,
        _ if divided.contains(&axis) => near(axis),
        _ => 1..=1,
    })
}

/// Edge (m) of the cubes of which `count` fill the box along the axes of `divided`.
fn cube_edge(divided: &[usize], size: [f64; 3], count: u64) -> f64 {
    let product: f64 = divided.iter().map(|axis| size[*axis]).product::<f64>() / count as f64;
    if divided.len() == 3 && product.is_normal() {
        return libm::cbrt(product);
    }
    // The product of edges may leave the range of numbers, the sum of their logarithms does not.
    let log = divided.iter().map(|axis| libm::log(size[*axis])).sum::<f64>() - libm::log(count as f64);
    libm::exp(log / divided.len() as f64)
}

/// One particle in each of the cells of a box, before it is moved.
pub(super) fn in_box(half: [f64; 3], cells: [u64; 3], jitter: Jitter) -> Vec<[f64; 3]> {
    let edge = [0, 1, 2].map(|c| 2.0 * half[c] / cells[c] as f64);
    let [nx, ny, nz] = cells.map(|n| n as i64);
    let mut points = Vec::with_capacity((nx * ny * nz) as usize);
    for (i, j, k) in triples([0..nx, 0..ny, 0..nz]) {
        interrupt::point();
        let shift = shift([i, j, k], jitter);
        let index = [i, j, k];
        // About the middle, so that a lattice without jitter is symmetric to the last bit.
        points.push([0, 1, 2].map(|c| {
            let from_middle = index[c] as f64 - 0.5 * (cells[c] as f64 - 1.0);
            (from_middle + shift[c]) * edge[c]
        }));
    }

    points
}

/// One particle in each cube of edge `spacing` (m), where that is inside. Cubes and rows of cubes count as
/// positions that are tried.
pub(super) fn in_solid(
    solid: &Solid,
    spacing: f64,
    jitter: Jitter,
    looks: &mut Looks,
) -> Result<Vec<[f64; 3]>, TooMuch> {
    let [low, high] = solid.bounds();
    let middle = [0, 1, 2].map(|c| 0.5 * (low[c] + high[c]));
    let half = [0, 1, 2].map(|c| (0.5 * (high[c] - low[c]) / spacing).ceil());
    let most = looks.at_once();
    if half[0] * half[1] * 4.0 > most as f64 {
        return Err(TooMuch);
    }
    let mut left = most;
    let mut points = Vec::new();
    let [nx, ny, nz] = half.map(|h| h.min(1e9) as i64);
    for (i, j) in (-nx..nx).flat_map(|i| (-ny..ny).map(move |j| (i, j))) {
        interrupt::point();
        left = left.checked_sub(1).ok_or(TooMuch)?;
        let corner = |di: i64| [middle[0] + (i + di) as f64 * spacing, middle[1] + (j + di) as f64 * spacing];
        let Some([bottom, top]) = solid.heights(corner(0), corner(1)) else { continue };
        let row = |z: f64| ((z - middle[2]) / spacing).clamp(-2e9, 2e9);
        let rows = (row(bottom).floor() as i64 - 1).max(-nz)..(row(top).ceil() as i64 + 1).min(nz);
        for k in rows {
            interrupt::point();
            left = left.checked_sub(1).ok_or(TooMuch)?;
            let shift = shift([i, j, k], jitter);
            let index = [i, j, k];
            let point = [0, 1, 2].map(|c| middle[c] + (index[c] as f64 + 0.5 + shift[c]) * spacing);
            if solid.contains(point) {
                points.push(point);
            }
        }
    }

    looks.take(most - left)?;
    Ok(points)
}

/// How far from the middle of its cell a particle lies, in edges of the cell.
fn shift(cell: [i64; 3], jitter: Jitter) -> [f64; 3] {
    if jitter.amount == 0.0 {
        return [0.0; 3];
    }
    Sequence::new(jitter.seed, Stream::Position, cell).point().map(|u| jitter.amount * (u - 0.5))
}

fn triples([x, y, z]: [std::ops::Range<i64>; 3]) -> impl Iterator<Item = (i64, i64, i64)> {
    x.flat_map(move |i| {
        let z = z.clone();
        y.clone().flat_map(move |j| z.clone().map(move |k| (i, j, k)))
    })
}

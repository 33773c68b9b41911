//! Particles at random positions, no two nearer than a radius (Bridson 2007, in three dimensions).
//!
//! New particles are tried in a thin shell around those that are there, just beyond a radius. Cells of
//! the background hold one particle at most. Each empty cell then starts again, so that parts of a
//! solid that nothing joins are filled too.

use nappe_sim::interrupt;

use super::{
    hash::{Sequence, Stream},
    lattice::{Looks, TooMuch},
    solid::Solid,
};

/// Positions tried around a particle before it is given up.
const TRIES: usize = 15;
/// Outer radius of the shell, in radii.
const SHELL: f64 = 1.15;
/// A cell that holds no particle.
const EMPTY: u32 = u32::MAX;

/// Particles (m) at least `radius` (m) apart; each cell of their background counts as a position that is tried.
pub(super) fn sample(
    solid: &Solid,
    radius: f64,
    seed: u32,
    looks: &mut Looks,
) -> Result<Vec<[f64; 3]>, TooMuch> {
    let mut found = Background::new(solid, radius, looks)?;
    let mut numbers = Sequence::new(seed, Stream::Dart, [0; 3]);
    let mut active: Vec<u32> = Vec::new();
    for cell in 0..found.cells.len() {
        interrupt::point();
        if found.cells[cell] == EMPTY {
            let position = found.within(cell, numbers.point());
            active.extend(found.add(solid, position));
        }
        while !active.is_empty() {
            interrupt::point();
            let chosen = numbers.below(active.len());
            let around = found.points[active[chosen] as usize];
            let found = (0..TRIES).find_map(|_| {
                let position = shell(around, radius, &mut numbers);
                found.add(solid, position)
            });
            match found {
                Some(new) => active.push(new),
                None => drop(active.swap_remove(chosen)),
            }
        }
    }

    Ok(found.points)
}

/// A position a little farther than a radius from a point, evenly in volume: particles then lie closer
/// than when the shell is as wide as two radii.
fn shell(around: [f64; 3], radius: f64, numbers: &mut Sequence) -> [f64; 3] {
    loop {
        let offset = numbers.point().map(|u| SHELL * (2.0 * u - 1.0));
        let distance2: f64 = offset.iter().map(|c| c * c).sum();
        if (1.0..=SHELL * SHELL).contains(&distance2) {
            return [0, 1, 2].map(|c| around[c] + radius * offset[c]);
        }
    }
}

/// Particles so far, in cells whose diagonal is a radius.
struct Background {
    low: [f64; 3],
    edge: f64,
    radius2: f64,
    counts: [i64; 3],
    cells: Vec<u32>,
    points: Vec<[f64; 3]>,
}

impl Background {
    fn new(solid: &Solid, radius: f64, looks: &mut Looks) -> Result<Self, TooMuch> {
        let [low, high] = solid.bounds();
        let edge = radius / 3.0_f64.sqrt();
        let counts = [0, 1, 2].map(|c| ((high[c] - low[c]) / edge).ceil().max(1.0));
        let count = counts.iter().product::<f64>();
        // A number beyond the range of u64 becomes the largest there is.
        looks.take(count as u64)?;
        let cells = vec![EMPTY; count as usize];
        let counts = counts.map(|n| n as i64);
        Ok(Self { low, edge, radius2: radius * radius, counts, cells, points: Vec::new() })
    }

    /// A position within a cell.
    fn within(&self, cell: usize, share: [f64; 3]) -> [f64; 3] {
        let (cell, [_, ny, nz]) = (cell as i64, self.counts);
        let index = [cell / (ny * nz), cell / nz % ny, cell % nz];
        [0, 1, 2].map(|c| self.low[c] + (index[c] as f64 + share[c]) * self.edge)
    }

    /// Adds a particle if it is inside and far enough from all others; its index.
    fn add(&mut self, solid: &Solid, position: [f64; 3]) -> Option<u32> {
        let index = [0, 1, 2].map(|c| ((position[c] - self.low[c]) / self.edge).floor() as i64);
        if (0..3).any(|c| !(0..self.counts[c]).contains(&index[c])) {
            return None;
        }
        if self.is_near(position, index) || !solid.contains(position) {
            return None;
        }
        let new = self.points.len() as u32;
        let cell = self.cell(index);
        self.cells[cell] = new;
        self.points.push(position);
        Some(new)
    }

    fn cell(&self, [i, j, k]: [i64; 3]) -> usize {
        ((i * self.counts[1] + j) * self.counts[2] + k) as usize
    }

    fn is_near(&self, position: [f64; 3], index: [i64; 3]) -> bool {
        // Its own cell first: most positions fail there. A radius is less than two cells' edges.
        if self.cells[self.cell(index)] != EMPTY {
            return true;
        }
        let [x, y, z] = [0, 1, 2].map(|c| (index[c] - 2).max(0)..=(index[c] + 2).min(self.counts[c] - 1));
        for i in x {
            for j in y.clone() {
                let row = self.cell([i, j, 0]);
                for k in z.clone() {
                    let other = self.cells[row + k as usize];
                    if other != EMPTY && self.distance2(other, position) < self.radius2 {
                        return true;
                    }
                }
            }
        }

        false
    }

    fn distance2(&self, other: u32, position: [f64; 3]) -> f64 {
        let other = self.points[other as usize];
        (0..3).map(|c| (other[c] - position[c]) * (other[c] - position[c])).sum()
    }
}

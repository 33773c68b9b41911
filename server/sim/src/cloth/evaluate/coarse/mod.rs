//! The matrix of a step on the coarse space of its preconditioner: Pᵀ A P, a block of rows at a time.

use std::ops::Range;

use super::step_matrix::StepMatrix;
use crate::{
    cloth::layout::{BlockScratch, Visit},
    linalg::{CoarseLayout, NineByNine, add_lanes},
    math::{LANES, Pack, Padded, Real, WithSimd, dispatch, three},
};

impl<R: Real> StepMatrix<'_, R> {
    /// Writes what the aggregates of a block of rows have with others, at the places that the layout says.
    pub(crate) fn project(&self, layout: &CoarseLayout, block: usize, blocks: &mut [NineByNine]) {
        let scratch = &mut *self.scratches.take();
        dispatch::<R, _>(Project { matrix: *self, layout, block, blocks, scratch });
    }
}

struct Project<'a, R: Real> {
    matrix: StepMatrix<'a, R>,
    layout: &'a CoarseLayout,
    block: usize,
    blocks: &'a mut [NineByNine],
    scratch: &'a mut BlockScratch<R>,
}

impl<R: Real> WithSimd<R> for Project<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let Self { matrix, layout, block, blocks, scratch } = self;
        let StepMatrix { model, .. } = matrix;
        let first = block * model.block_size;
        let rows = first..(first + model.block_size).min(model.count);
        blocks.fill([[0.0; 12]; 9]);

        let BlockScratch { records, aggregates, .. } = scratch;
        let within = [[[P::Wide::zero(); 6]; 6]; CoarseLayout::MOST_PER_BLOCK];
        let mut sums = Springs::<P> { matrix, layout, first, blocks, aggregates, within };
        // Lanes beyond the last particle are read too: their fields are 0.
        let padded = first..(first + model.block_size).min(model.m.len());
        model.springs.visit_block(block, padded, records, &mut sums);
        let within = sums.within;

        expand(blocks);
        matrix.add_within::<P>(layout, rows, &within, blocks);
        matrix.project_elements::<P>(layout, block, blocks);
    }
}

/// Which of the products 11, 1u, 1v, uu, uv, vv belongs to two of the functions 1, u, v.
const PAIR: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];
/// Which of xx, yy, zz, xy, xz, yz belongs to two axes.
const ENTRY: [[usize; 3]; 3] = [[0, 3, 4], [3, 1, 5], [4, 5, 2]];
/// The two axes of each of them.
const AXES: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]];

/// Sums over the springs of a block of rows.
struct Springs<'a, P: Pack> {
    matrix: StepMatrix<'a, P::Number>,
    layout: &'a CoarseLayout,
    /// First row of the block.
    first: usize,
    /// Between two aggregates: of a spring's symmetric block, in the first six columns, times products of functions.
    blocks: &'a mut [NineByNine],
    /// The aggregates of the halo's particles.
    aggregates: &'a mut [u32],
    /// Within each of the block's aggregates: entries of symmetric blocks, times products of functions.
    within: [[[P::Wide; 6]; 6]; CoarseLayout::MOST_PER_BLOCK],
}

impl<P: Pack> Visit<P> for Springs<'_, P> {
    #[inline(always)]
    fn vectors(&self, particle: usize) -> [Padded<P::Number>; 2] {
        let [one, u, v] = self.layout.at(particle);
        let of = P::Number::of;
        [self.matrix.x[particle], Padded([of(one), of(u), of(v), of(0.0)])]
    }

    #[inline(always)]
    fn begin(&mut self, halo: &[u32]) {
        for (aggregate, &particle) in self.aggregates.iter_mut().zip(halo) {
            *aggregate = self.layout.aggregate(particle as usize) as u32;
        }
    }

    #[inline(always)]
    fn slot(
        &mut self,
        (slot, row): (usize, usize),
        own: [[P; 3]; 2],
        others: [[P; 3]; 2],
        names: &[u16; LANES],
    ) {
        let StepMatrix { model, numbers, tangent, .. } = self.matrix;
        let d = P::widen3(three!(|c| own[0][c] - others[0][c]));
        let b = P::load(&tangent[slot]).widen();
        let along = P::load(&numbers.along[model.springs.pattern_of[slot] as usize]).widen();
        let a = along - b * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        let scaled = three!(|c| b * d[c]);
        let entries = [
            a + scaled[0] * d[0],
            a + scaled[1] * d[1],
            a + scaled[2] * d[2],
            scaled[0] * d[1],
            scaled[0] * d[2],
            scaled[1] * d[2],
        ];

        // The aggregate at the other end, where it is not that of the row.
        let mut across = [None; LANES];
        let (mut inside, mut scale) = ([1.0; LANES], [0.5_f64.sqrt(); LANES]);
        for lane in 0..LANES {
            across[lane] = self.other_aggregate(row + lane, usize::from(names[lane]));
            if across[lane].is_some() {
                (inside[lane], scale[lane]) = (0.0, 1.0);
            }
        }

        // Both ends count a spring within an aggregate, and what is the same at both ends adds exactly 0.
        let (inside, scale) = (P::Wide::load(&inside), P::Wide::load(&scale));
        let (here, there) = (P::widen3(own[1]), P::widen3(others[1]));
        let f = three!(|m| (here[m] - there[m] * inside) * scale);
        for part in 0..self.layout.per_block() {
            let f = self.of_part(f, row, part);
            let products = [f[0] * f[0], f[0] * f[1], f[0] * f[2], f[1] * f[1], f[1] * f[2], f[2] * f[2]];
            for entry in 0..6 {
                for pair in 0..6 {
                    self.within[part][entry][pair] += entries[entry] * products[pair];
                }
            }
        }
        if across.iter().any(Option::is_some) {
            self.add_across(&entries, here, there, (row, &across));
        }
    }
}

impl<P: Pack> Springs<'_, P> {
    /// The aggregate of a spring's other end, by its name, if it is not the row's own.
    #[inline(always)]
    fn other_aggregate(&self, row: usize, name: usize) -> Option<u32> {
        let block_size = self.matrix.model.block_size;
        if name >= block_size {
            return Some(self.aggregates[name - block_size]);
        }
        if self.layout.per_block() == 1 {
            return None;
        }
        let other = self.layout.aggregate(self.first + name);
        (other != self.layout.aggregate(row)).then_some(other as u32)
    }

    /// Lanes of rows in one of the block's aggregates, 0 in those of others.
    #[inline(always)]
    fn of_part(&self, f: [P::Wide; 3], row: usize, part: usize) -> [P::Wide; 3] {
        if self.layout.per_block() == 1 {
            return f;
        }
        let mut is_member = [0.0; LANES];
        for lane in 0..LANES {
            is_member[lane] = if self.layout.part(row + lane) == part { 1.0 } else { 0.0 };
        }
        let is_member = P::Wide::load(&is_member);
        three!(|m| f[m] * is_member)
    }

    /// Subtracts f(own) f(other)ᵀ times the blocks of springs to other aggregates.
    #[inline(always)]
    fn add_across(
        &mut self,
        entries: &[P::Wide; 6],
        here: [P::Wide; 3],
        there: [P::Wide; 3],
        (row, across): (usize, &[Option<u32>; LANES]),
    ) {
        let [here, there] = [three!(|m| here[m].store()), three!(|m| there[m].store())];
        let mut values = [[0.0; LANES]; 6];
        for entry in 0..6 {
            values[entry] = entries[entry].store();
        }
        for (lane, other) in across.iter().enumerate() {
            let &Some(other) = other else { continue };
            let place = self.layout.place(self.layout.aggregate(row + lane), other as usize);
            let sums = &mut self.blocks[place];
            let mut products = [0.0; 12];
            for m in 0..3 {
                for q in 0..3 {
                    products[4 * m + q] = here[m][lane] * there[q][lane];
                }
            }
            for entry in 0..6 {
                let value = values[entry][lane];
                for k in 0..12 {
                    sums[entry][k] -= value * products[k];
                }
            }
        }
    }
}

/// From entries of symmetric blocks times products of functions to the blocks of the matrix.
#[inline(always)]
fn expand(blocks: &mut [NineByNine]) {
    for block in blocks {
        let sums = *block;
        for q in 0..3 {
            for t in 0..3 {
                for m in 0..3 {
                    for s in 0..3 {
                        block[3 * q + t][4 * m + s] = sums[ENTRY[s][t]][4 * m + q];
                    }
                    block[3 * q + t][4 * m + 3] = 0.0;
                }
            }
        }
    }
}

impl<R: Real> StepMatrix<'_, R> {
    /// Adds the springs within the aggregates of a block, and its masses.
    #[inline(always)]
    fn add_within<P: Pack<Number = R>>(
        &self,
        layout: &CoarseLayout,
        rows: Range<usize>,
        within: &[[[P::Wide; 6]; 6]; CoarseLayout::MOST_PER_BLOCK],
        blocks: &mut [NineByNine],
    ) {
        let mut sums = [[[0.0; 6]; 6]; CoarseLayout::MOST_PER_BLOCK];
        for part in 0..layout.per_block() {
            for entry in 0..6 {
                for pair in 0..6 {
                    sums[part][entry][pair] = add_lanes(within[part][entry][pair].store());
                }
            }
        }
        let h = R::of(self.numbers.scheme.h);
        let first = layout.aggregate(rows.start) / layout.per_block() * layout.per_block();
        for row in rows {
            let external = &self.numbers.external;
            let (mass, f) = (external.mass(self.model.m[row], h).to_f64(), layout.at(row));
            let air = external.air_of(row).map(|air| air.map(|entry| (entry * h).to_f64()));
            for m in 0..3 {
                for q in m..3 {
                    for axis in 0..3 {
                        sums[layout.part(row)][axis][PAIR[m][q]] += mass * f[m] * f[q];
                    }
                    for (entry, [s, t]) in AXES.into_iter().enumerate() {
                        if let Some(air) = &air {
                            sums[layout.part(row)][entry][PAIR[m][q]] += air[(s, t)] * f[m] * f[q];
                        }
                    }
                }
            }
        }
        for part in 0..layout.per_block() {
            let block = &mut blocks[layout.place(first + part, first + part)];
            for q in 0..3 {
                for t in 0..3 {
                    for m in 0..3 {
                        for s in 0..3 {
                            block[3 * q + t][4 * m + s] += sums[part][ENTRY[s][t]][PAIR[m][q]];
                        }
                    }
                }
            }
        }
    }

    /// Adds what elements have.
    #[inline(always)]
    fn project_elements<P: Pack<Number = R>>(
        &self,
        layout: &CoarseLayout,
        block: usize,
        blocks: &mut [NineByNine],
    ) {
        let mut first = 0;
        for (elements, numbers) in self.model.elements.iter().zip(&self.numbers.elements) {
            let range = elements.frozen(block);
            let frozen: &[[R; LANES]] = &self.frozen[first + range.start..first + range.end];
            elements.project::<P>((block, layout), numbers.matrix.to_f64(), frozen, blocks);
            first += elements.frozen_count();
        }
    }
}

#[cfg(test)]
mod tests;

//! What elements add to the matrix on the coarse space of the blocks.

use super::Packs;
use crate::{
    cloth::laws::ElementLaw,
    linalg::{CoarseLayout, NineByNine},
    math::{LANES, Pack, Real, three},
};

/// What the corners of sixteen elements are, by corner and lane: aggregates, whether they are the block's, and functions.
struct Corners<const N: usize> {
    aggregates: [[usize; LANES]; N],
    is_own: [[bool; LANES]; N],
    functions: [[[f64; LANES]; 3]; N],
}

impl<R: Real, const N: usize, const C: usize> Packs<R, N, C> {
    /// Adds `scale` Pᵀ H P of a block's elements: rows of the block's aggregates, at the places that the layout says.
    #[inline(always)]
    pub(super) fn project<L: ElementLaw<N, C, F>, W: Pack<Number = f64>, const F: usize>(
        &self,
        (block, layout): (usize, &CoarseLayout),
        scale: f64,
        frozen: &[[R; LANES]],
        blocks: &mut [NineByNine],
    ) {
        let first = self.lists.packs(block).start;
        for (halo, packs) in self.lists.halos.parts(block) {
            for pack in packs {
                let corners = self.corners((block, layout), pack, halo.particles());
                let (mut rest, mut tangent) = ([W::zero(); C], [W::zero(); F]);
                for c in 0..C {
                    rest[c] = widen(&self.rest[pack][c]);
                }
                for f in 0..F {
                    tangent[f] = widen(&frozen[(pack - first) * F + f]);
                }

                for other in 0..N {
                    for axis in 0..3 {
                        let mut w = [[W::zero(); 3]; N];
                        w[other][axis] = W::splat(scale);
                        let push = L::product(rest, tangent, w);
                        for corner in 0..N {
                            let columns = three!(|s| push[corner][s].store());
                            corners.add(layout, blocks, ([corner, other], axis), &columns);
                        }
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn corners(&self, (block, layout): (usize, &CoarseLayout), pack: usize, particles: &[u32]) -> Corners<N> {
        let mut corners = Corners {
            aggregates: [[0; LANES]; N],
            is_own: [[false; LANES]; N],
            functions: [[[0.0; LANES]; 3]; N],
        };
        for corner in 0..N {
            for (lane, &name) in self.lists.names(pack, corner).iter().enumerate() {
                let name = usize::from(name);
                let is_own = name < self.lists.block_size;
                let particle = if is_own {
                    block * self.lists.block_size + name
                } else {
                    particles[name - self.lists.block_size] as usize
                };
                corners.aggregates[corner][lane] = layout.aggregate(particle);
                corners.is_own[corner][lane] = is_own;
                let at = layout.at(particle);
                for m in 0..3 {
                    corners.functions[corner][m][lane] = at[m];
                }
            }
        }
        corners
    }
}

impl<const N: usize> Corners<N> {
    /// Adds what an axis of one corner pushes another with, element after element.
    #[inline(always)]
    fn add(
        &self,
        layout: &CoarseLayout,
        blocks: &mut [NineByNine],
        ([corner, other], axis): ([usize; 2], usize),
        push: &[[f64; LANES]; 3],
    ) {
        for lane in 0..LANES {
            if !self.is_own[corner][lane] {
                continue;
            }
            let place = layout.place(self.aggregates[corner][lane], self.aggregates[other][lane]);
            let mut column = [0.0; 12];
            for m in 0..3 {
                for s in 0..3 {
                    column[4 * m + s] = self.functions[corner][m][lane] * push[s][lane];
                }
            }
            for q in 0..3 {
                let function = self.functions[other][q][lane];
                for row in 0..12 {
                    blocks[place][3 * q + axis][row] += column[row] * function;
                }
            }
        }
    }
}

/// Lanes in binary64.
#[inline(always)]
pub(super) fn widen<R: Real, W: Pack<Number = f64>>(lanes: &[R; LANES]) -> W {
    let mut wide = [0.0; LANES];
    for lane in 0..LANES {
        wide[lane] = lanes[lane].to_f64();
    }
    W::load(&wide)
}

//! Elements one by one: the blocks of the matrix that each has at its corners in a block of rows.

use super::{Packs, project::widen};
use crate::{
    cloth::laws::ElementLaw,
    linalg::TakeParts,
    math::{LANES, Pack, Real, three},
};

impl<R: Real, const N: usize, const C: usize> Packs<R, N, C> {
    /// Hands over `scale` H of a block's elements, in their order: rows of corners in the block.
    #[inline(always)]
    pub(super) fn hand_over<L: ElementLaw<N, C, F>, W: Pack<Number = f64>, const F: usize>(
        &self,
        block: usize,
        scale: f64,
        frozen: &[[R; LANES]],
        take: &mut dyn TakeParts,
    ) {
        let (first, block_size) = (self.lists.packs(block).start, self.lists.block_size);
        for (halo, packs) in self.lists.halos.parts(block) {
            for pack in packs {
                let (mut rest, mut tangent) = ([W::zero(); C], [W::zero(); F]);
                for c in 0..C {
                    rest[c] = widen(&self.rest[pack][c]);
                }
                for f in 0..F {
                    tangent[f] = widen(&frozen[(pack - first) * F + f]);
                }
                // By what moves, along which axis, and which corner it pushes along which axis.
                let mut pushes = [[[[[0.0; LANES]; 3]; N]; 3]; N];
                for other in 0..N {
                    for axis in 0..3 {
                        let mut w = [[W::zero(); 3]; N];
                        w[other][axis] = W::splat(scale);
                        let push = L::product(rest, tangent, w);
                        for corner in 0..N {
                            pushes[other][axis][corner] = three!(|s| push[corner][s].store());
                        }
                    }
                }

                let count = self.lists.names(pack, 0).len();
                for lane in 0..count {
                    let mut corners = [0; N];
                    let mut is_own = [false; N];
                    for corner in 0..N {
                        let name = usize::from(self.lists.names(pack, corner)[lane]);
                        is_own[corner] = name < block_size;
                        corners[corner] = if is_own[corner] {
                            (block * block_size + name) as u32
                        } else {
                            halo.particles()[name - block_size]
                        };
                    }
                    for own in 0..N {
                        if is_own[own] {
                            let mut blocks = [[[0.0; 3]; 3]; N];
                            for other in 0..N {
                                for s in 0..3 {
                                    blocks[other][s] = three!(|axis| pushes[other][axis][own][s][lane]);
                                }
                            }
                            take.element(&corners, own, &blocks);
                        }
                    }
                }
            }
        }
    }
}

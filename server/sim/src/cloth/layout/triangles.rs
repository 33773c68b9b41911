//! Triangles of a body that the air acts on, listed by block.

use super::{halo::behind, lists::Lists, scratch::BlockScratch};
use crate::math::{Pack, Padded, Real, three};

/// What sixteen triangles add to the matrices of their corners. A trait, and no closure, which would not be compiled for the
/// instructions of the kernel.
pub(crate) trait OfTriangle<P> {
    /// xx, yy, zz, xy, xz, yz, from two vectors of each corner.
    fn matrix(&self, x: [[P; 3]; 3], y: [[P; 3]; 3]) -> [P; 6];
}

/// Triangles, in packs of sixteen.
#[derive(Clone, Debug)]
pub(crate) struct Triangles(Lists<3>);

impl Triangles {
    /// Lists triangles by block, each in every block that it touches; `place` gives the model's numbering.
    pub(crate) fn new(triangles: &[[u32; 3]], block_size: usize, place: &[u32]) -> Self {
        Self(Lists::new(triangles, block_size, place, &mut |_| {}))
    }

    /// Records that a block copies, at most.
    pub(crate) fn room(&self) -> usize {
        self.0.room()
    }

    /// Adds the symmetric matrix that `law` makes of sixteen triangles, from two vectors of each of their corners, to the
    /// block's rows at these corners. The block's own particles have been copied.
    #[inline(always)]
    pub(crate) fn add_up<P: Pack<Number = R>, R: Real>(
        &self,
        block: usize,
        fields: [&[Padded<R>]; 2],
        scratch: &mut BlockScratch<R>,
        law: &impl OfTriangle<P>,
    ) {
        let Self(lists) = self;
        assert!(scratch.records.len() >= lists.room(), "room for a block and its halo");
        for (halo, packs) in lists.halos.parts(block) {
            halo.copy(behind(&mut scratch.records, lists.block_size), fields);
            for pack in packs {
                let (x, y) = lists.gather::<P>(pack, &scratch.records);
                let matrix = law.matrix(x, y);
                let names = three!(|corner| lists.names(pack, corner));
                scratch.matrices.add(names, matrix);
            }
        }
    }
}

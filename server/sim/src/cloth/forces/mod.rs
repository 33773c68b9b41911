//! Forces on particles: springs, then the drag of the medium. Gravity is an acceleration and is
//! added where forces become accelerations.

mod spring;

pub(super) use spring::{
    BlockProduct, DiagonalBlock, ElasticBlockProduct, Energy, SpringBlock, Transverse, WithTransverse,
    with_transverse,
};
pub use spring::{spring_force, spring_jacobian_v, spring_jacobian_x};

use rayon::prelude::*;
use spring::Force;

use super::{
    model::Model,
    sell::{Sell, vectors},
    state::Frozen,
};
use crate::math::{Pack, Padded, Real, Vec3, WithSimd, dispatch};

/// f = springs' forces - drag (v - wind), N, at positions `x` (m) and velocities `v` (m/s).
pub(super) fn add_forces<R: Real>(
    model: &Model<R>,
    frozen: &Frozen<R>,
    [x, v]: [&[Padded<R>]; 2],
    f: &mut [Vec3<R>],
) {
    let block_size = model.block_size;
    f.par_chunks_mut(block_size).enumerate().for_each(|(block, f)| {
        dispatch(BlockForces { springs: &model.springs, frozen, x, v, first: block * block_size, f });
    });
}

struct BlockForces<'a, R: Real> {
    springs: &'a Sell<R>,
    frozen: &'a Frozen<R>,
    x: &'a [Padded<R>],
    v: &'a [Padded<R>],
    first: usize,
    f: &'a mut [Vec3<R>],
}

impl<R: Real> WithSimd<R> for BlockForces<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let (drag, wind) = (self.frozen.drag, self.frozen.wind);
        let zero = [P::zero(); 3];
        for rows in Sell::<R>::groups(self.first..self.first + self.f.len()) {
            let fields = [self.x, self.v];
            let sums = self.springs.fold_group(rows.start, fields, &self.frozen.laws, zero, Force);
            for (springs, i) in vectors(sums).into_iter().zip(rows) {
                self.f[i - self.first] = springs - (self.v[i].vector() - wind) * drag;
            }
        }
    }
}

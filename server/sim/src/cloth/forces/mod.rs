//! Forces on particles: springs, then the drag of the medium. Gravity is an acceleration and is
//! added where forces become accelerations.

mod spring;

pub(super) use spring::{
    Transverse, WithTransverse, elastic, force_on, tangent_block, tangent_on, with_transverse,
};
pub use spring::{spring_force, spring_jacobian_v, spring_jacobian_x};

use rayon::prelude::*;

use super::{model::Model, rows::Rows, state::Frozen};
use crate::{
    math::{Real, Vec3},
    parallel::{Kernel, dispatch},
};

/// f = springs' forces - drag (v - wind), N, at positions `x` (m) and velocities `v` (m/s).
pub(super) fn add_forces<R: Real>(
    model: &Model<R>,
    frozen: &Frozen<R>,
    x: &[Vec3<R>],
    v: &[Vec3<R>],
    f: &mut [Vec3<R>],
) {
    let grain = model.grain;
    f.par_chunks_mut(grain).enumerate().for_each(|(block, f)| {
        dispatch(BlockForces { rows: &model.rows, frozen, x, v, first: block * grain, f });
    });
}

struct BlockForces<'a, R: Real> {
    rows: &'a Rows<R>,
    frozen: &'a Frozen<R>,
    x: &'a [Vec3<R>],
    v: &'a [Vec3<R>],
    first: usize,
    f: &'a mut [Vec3<R>],
}

impl<R: Real> Kernel for BlockForces<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (drag, wind) = (self.frozen.drag, self.frozen.wind);
        for rows in Rows::<R>::groups(self.first..self.first + self.f.len()) {
            let fields = [self.x, self.v];
            let sums =
                self.rows.fold_group(rows.start, fields, &self.frozen.laws, Default::default(), force_on);
            for (lane, i) in rows.enumerate() {
                let springs = Vec3::new(sums[0][lane], sums[1][lane], sums[2][lane]);
                self.f[i - self.first] = springs - (self.v[i] - wind) * drag;
            }
        }
    }
}

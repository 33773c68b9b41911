//! The air, frozen at a state: what its triangles add to each particle.

use super::external::External;
use crate::{
    cloth::{
        laws::third,
        layout::{BlockScratch, Model, OfTriangle, Scratches, Triangles, copy_own},
    },
    math::{LANES, Pack, Padded, Real, Sixteen, WithSimd, dispatch},
    parallel::{per_sixteen_mut, size},
};

impl<R: Real> External<R> {
    /// Freezes the air at positions (m) and velocities (m/s), of which neighbours have computed what own rows read.
    pub(crate) fn freeze_air(
        &mut self,
        model: &Model<R>,
        fields: [&[Padded<R>]; 2],
        scratches: &Scratches<R>,
    ) {
        let Self { wind, factors, air, .. } = self;
        let (Some(triangles), Some(factors)) = (&model.triangles, *factors) else { return };
        size(air, Sixteen::<R>::count_for(model.count));
        let wind = [wind.x, wind.y, wind.z];
        let scratch = || scratches.take();
        let rows = per_sixteen_mut(air);
        model.share.own().each_with(scratch, rows, |scratch, block, rows| {
            let first = block * model.block_size;
            dispatch(Freeze { triangles, block, first, factors, wind, fields, rows, scratch });
        });
    }
}

/// A block whose air is frozen.
struct Freeze<'a, R: Real> {
    triangles: &'a Triangles,
    block: usize,
    /// Its first row.
    first: usize,
    factors: [R; 3],
    wind: [R; 3],
    fields: [&'a [Padded<R>]; 2],
    rows: &'a mut [[[R; LANES]; 6]],
    scratch: &'a mut BlockScratch<R>,
}

/// The share of each corner of triangles, in wind (m/s).
struct Third<R> {
    factors: [R; 3],
    wind: [R; 3],
}

impl<P: Pack> OfTriangle<P> for Third<P::Number> {
    #[inline(always)]
    fn matrix(&self, x: [[P; 3]; 3], v: [[P; 3]; 3]) -> [P; 6] {
        third(self.factors, self.wind, x, v)
    }
}

impl<R: Real> WithSimd<R> for Freeze<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let Self { triangles, block, first, factors, wind, fields, rows, scratch } = self;
        let count = rows.len() * LANES;
        copy_own(&mut scratch.records, first..first + count, fields);
        scratch.matrices.clear();
        triangles.add_up::<P, R>(block, fields, scratch, &Third { factors, wind });
        for (group, row) in rows.iter_mut().enumerate() {
            let sums = scratch.matrices.sixteen::<P>(group);
            for c in 0..6 {
                row[c] = sums[c].store();
            }
        }
    }
}

//! What parts without pins do as one, taken out of a linear solve: gravity and the medium move them so, and no spring feels
//! it. A residual that is small beside gravity is not small beside what is left, and would push a falling sheet aside.
//!
//! Reads and writes the right-hand side (N s) before a solve and the change of velocities (m/s) after it.

use super::update::Step;
use crate::{
    cloth::{
        evaluate::{Evaluated, StepNumbers, symmetric},
        layout::Model,
    },
    linalg::{lane_sums, lanes_at},
    math::{LANES, Mat3, Pack, Real, Sixteen, Vec3, WithSimd, dispatch, three},
    parallel::{per_block_mut, per_row, per_sixteen, per_sixteen_mut},
};

/// A change of velocity that all loose rows have.
#[derive(Clone, Copy)]
pub(super) struct CommonPart<R> {
    /// (m/s)
    change: [R; 3],
    /// By how much it lowers what the solve minimises (J).
    pub(super) descent: f64,
}

impl<R: Real> Step<'_, R> {
    /// Takes off the right-hand side what the change of velocity makes up for by which the momentum of all loose rows
    /// balances. None where no row is loose, nothing acts on all of them, or a force is not finite.
    pub(super) fn take_common_part(&mut self) -> Option<CommonPart<R>> {
        let model = self.model;
        let loose = model.loose.as_ref()?;
        let Evaluated { evaluation, numbers, .. } = &mut *self.evaluated;
        let momenta = &mut self.vectors.momenta;
        if numbers.gravity.iter().all(|c| *c == R::zero()) && numbers.external.is_still() {
            return None;
        }
        let (own, size) = (model.share.own(), model.block_size / LANES);
        let fields = (per_block_mut(momenta), per_row(&loose.m), per_sixteen(&evaluation.rows));
        own.each(fields, |block, (momentum, m, rows)| {
            *momentum = dispatch(Momentum { m, rows, numbers, first: block * size });
        });
        // As the matrix has it, whose product with what all rows share is this alone.
        let h = R::of(numbers.scheme.h);
        let mass = loose.mass + numbers.external.mass(R::zero(), h).to_f64() * loose.count as f64;
        let (sum, matrix, change);
        if numbers.external.has_air() {
            let [x, y, z, air @ ..] = model.share.sum(momenta, &|momentum| *momentum);
            sum = Vec3::new(x, y, z);
            matrix = Mat3::from_diagonal_element(mass) + symmetric(air) * h.to_f64();
            change = matrix.cholesky()?.solve(&sum);
        } else {
            sum = Vec3::from(model.share.sum(momenta, &|[x, y, z, ..]| [*x, *y, *z]));
            matrix = Mat3::from_diagonal_element(mass);
            change = sum.map(|c| c / mass);
        }
        let change = change.map(R::of);
        if !change.iter().all(|c| c.to_f64().is_finite()) {
            return None;
        }
        own.each((per_row(&loose.m), per_sixteen_mut(&mut evaluation.rows)), |block, (m, rows)| {
            let (first, change) = (block * size, [change.x, change.y, change.z]);
            dispatch(Take { m, rows, numbers, first, change });
        });
        let wide = change.map(R::to_f64);
        let descent = wide.dot(&sum) - 0.5 * wide.dot(&(matrix * wide));
        Some(CommonPart { change: [change.x, change.y, change.z], descent })
    }
}

impl<R: Real> CommonPart<R> {
    /// Adds it to changes of velocity that lack it.
    pub(super) fn add(&self, model: &Model<R>, dv: &mut [Sixteen<R>]) {
        shift(model, dv, self.change);
    }

    /// Takes it off changes of velocity that have it.
    pub(super) fn take_off(&self, model: &Model<R>, dv: &mut [Sixteen<R>]) {
        shift(model, dv, self.change.map(|c| R::zero() - c));
    }
}

/// Adds a vector to those of all loose rows.
fn shift<R: Real>(model: &Model<R>, vectors: &mut [Sixteen<R>], by: [R; 3]) {
    let Some(loose) = &model.loose else { return };
    model.share.own().each((per_row(&loose.m), per_sixteen_mut(vectors)), |_, (m, vectors)| {
        dispatch(Shift { m, vectors, by });
    });
}

/// The momentum (N s) that forces give to the loose rows of a block, and what the air adds there: B (N s/m), xx, yy, zz, xy, xz,
/// yz.
struct Momentum<'a, R: Real> {
    /// Masses of loose rows (kg), 0 for others.
    m: &'a [R],
    rows: &'a [Sixteen<R>],
    numbers: &'a StepNumbers<R>,
    /// Which group of sixteen the block begins with.
    first: usize,
}

impl<R: Real> WithSimd<R> for Momentum<'_, R> {
    type Output = [f64; 9];

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> [f64; 9] {
        let mut sums = [P::Wide::zero(); 9];
        for (group, row) in self.rows.iter().enumerate() {
            let m = lanes_at::<P>(self.m, group);
            let row = row.load::<P>();
            for c in 0..3 {
                sums[c] += row[c].where_positive(m).widen();
            }
            if let Some(air) = self.numbers.external.at::<P>(self.first + group).air {
                for c in 0..6 {
                    sums[3 + c] += air[c].where_positive(m).widen();
                }
            }
        }
        lane_sums(sums)
    }
}

struct Take<'a, R: Real> {
    m: &'a [R],
    rows: &'a mut [Sixteen<R>],
    numbers: &'a StepNumbers<R>,
    first: usize,
    change: [R; 3],
}

impl<R: Real> WithSimd<R> for Take<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let (change, h) = (three!(|c| P::splat(self.change[c])), R::of(self.numbers.scheme.h));
        for (group, row) in self.rows.iter_mut().enumerate() {
            let (m, old) = (lanes_at::<P>(self.m, group), row.load::<P>());
            let medium = self.numbers.external.at::<P>(self.first + group);
            let share = medium.add_product([P::zero(); 3], change, m, h);
            row.store(three!(|c| old[c] - share[c].where_positive(m)));
        }
    }
}

struct Shift<'a, R: Real> {
    m: &'a [R],
    vectors: &'a mut [Sixteen<R>],
    by: [R; 3],
}

impl<R: Real> WithSimd<R> for Shift<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        for (group, vector) in self.vectors.iter_mut().enumerate() {
            let (m, old) = (lanes_at::<P>(self.m, group), vector.load::<P>());
            vector.store(three!(|c| old[c] + P::splat(self.by[c]).where_positive(m)));
        }
    }
}

//! What parts without pins do as one, taken out of a linear solve: gravity and the medium move them so, and no spring feels
//! it. A residual that is small beside gravity is not small beside what is left, and would push a falling sheet aside.
//!
//! Reads and writes the right-hand side (N s) before a solve and the change of velocities (m/s) after it.

use super::update::Step;
use crate::{
    cloth::{evaluate::Workspace, layout::Model},
    linalg::{add_lanes, lanes_at},
    math::{Pack, Real, Sixteen, WithSimd, dispatch, three},
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
        let Workspace { evaluation, momenta, numbers, .. } = &mut *self.work;
        if numbers.gravity.iter().all(|c| *c == R::zero()) && numbers.drag == R::zero() {
            return None;
        }
        let own = model.share.own();
        let fields = (per_block_mut(momenta), per_row(&loose.m), per_sixteen(&evaluation.rows));
        own.each(fields, |_, (momentum, m, rows)| *momentum = dispatch(Momentum { m, rows }));
        let sum = model.share.sum(momenta, &|momentum| *momentum);

        // As the matrix has it, whose product with what all rows share is this alone.
        let drag = R::of(numbers.scheme.h) * numbers.drag;
        let mass = loose.mass + drag.to_f64() * loose.count as f64;
        let change = sum.map(|c| R::of(c / mass));
        if !change.iter().all(|c| c.to_f64().is_finite()) {
            return None;
        }
        own.each((per_row(&loose.m), per_sixteen_mut(&mut evaluation.rows)), |_, (m, rows)| {
            dispatch(Take { m, rows, change, drag });
        });
        let falls = change.iter().zip(sum).map(|(change, sum)| {
            let change = change.to_f64();
            change * sum - 0.5 * mass * change * change
        });
        Some(CommonPart { change, descent: falls.sum() })
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

/// The momentum (N s) that forces give to the loose rows of a block.
struct Momentum<'a, R: Real> {
    /// Masses of loose rows (kg), 0 for others.
    m: &'a [R],
    rows: &'a [Sixteen<R>],
}

impl<R: Real> WithSimd<R> for Momentum<'_, R> {
    type Output = [f64; 3];

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> [f64; 3] {
        let mut sums = [P::Wide::zero(); 3];
        for (group, row) in self.rows.iter().enumerate() {
            let m = lanes_at::<P>(self.m, group);
            let row = row.load::<P>();
            for c in 0..3 {
                sums[c] += row[c].where_positive(m).widen();
            }
        }
        sums.map(|lanes| add_lanes(lanes.store()))
    }
}

struct Take<'a, R: Real> {
    m: &'a [R],
    rows: &'a mut [Sixteen<R>],
    change: [R; 3],
    drag: R,
}

impl<R: Real> WithSimd<R> for Take<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        for (group, row) in self.rows.iter_mut().enumerate() {
            let m = lanes_at::<P>(self.m, group);
            let (mass, old) = ((m + P::splat(self.drag)).where_positive(m), row.load::<P>());
            row.store(three!(|c| old[c] - mass * self.change[c]));
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

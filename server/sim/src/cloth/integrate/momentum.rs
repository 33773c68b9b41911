//! Sweeps that take up what the sweeps before them did: each begins as far beyond the end of the one before as Nesterov's
//! method goes for a convex function (Nesterov 1983), k / (k + 3) of the change at the k-th; and without that where it
//! led uphill (O'Donoghue and Candes 2015, the gradient's restart). Errors of wave length n particles then take some n sweeps
//! in place of some n².

use super::{update::Step, vectors::Vectors};
use crate::{
    cloth::evaluate::SweepSums,
    linalg::{lane_sums, lanes_at, packs, store_padded},
    math::{LANES, Pack, Padded, Real, WithSimd, array::dot, dispatch, three},
    parallel::{per_block_mut, per_row, per_row_mut},
    report::Stage,
};

/// How many sweeps in a row have led downhill.
pub(super) struct Momentum(u32);

impl<R: Real> Step<'_, R> {
    /// Begins with the iterate in `next`.
    pub(super) fn gather_momentum(&mut self) -> Momentum {
        let Vectors { swept: [from, before], .. } = &mut *self.vectors;
        let fields = (per_row_mut(from), per_row_mut(before), per_row(&self.next.v));
        self.model.share.own().each(fields, |_, (from, before, v)| {
            from.copy_from_slice(v);
            before.copy_from_slice(v);
        });
        self.watch.lap(Stage::Position);
        Momentum(0)
    }

    /// Takes the iterate in `next`, to which a sweep led, beyond its end; says whether that sweep moved anything.
    pub(super) fn extrapolate(&mut self, momentum: &mut Momentum) -> bool {
        let (share, m) = (&self.model.share, per_row(&self.model.m));
        let Vectors { swept: [from, before], sweep_sums, .. } = &mut *self.vectors;
        let (next, numbers) = (&mut *self.next, &self.evaluated.numbers);
        let fields = (m, [per_row(from), per_row(before), per_row(&next.v)]);
        share.own().each((per_block_mut(sweep_sums), fields), |_, (sums, (m, [from, before, v]))| {
            *sums = dispatch(Led { m, from, before, v });
        });
        let SweepSums { uphill, way } = SweepSums::of_all(share, sweep_sums);
        if way == 0.0 {
            return false;
        }
        momentum.0 = if uphill > 0.0 { 0 } else { momentum.0.saturating_add(1) };

        let k = f64::from(momentum.0);
        let (beyond, h) = (R::of(k / (k + 3.0)), R::of(numbers.scheme.h));
        let swept = [per_row_mut(from), per_row_mut(before)];
        let iterate = [per_row_mut(&mut next.x), per_row_mut(&mut next.v)];
        share.own().each((swept, iterate), |_, ([from, before], [x, v])| {
            dispatch(Extrapolate { from, before, x, v, share: beyond, h });
        });
        self.watch.lap(Stage::Position);
        true
    }
}

/// Where a sweep led the particles of a block.
struct Led<'a, R: Real> {
    m: &'a [R],
    from: &'a [Padded<R>],
    before: &'a [Padded<R>],
    v: &'a [Padded<R>],
}

impl<R: Real> WithSimd<R> for Led<'_, R> {
    type Output = SweepSums;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> SweepSums {
        let [from, before, v] = [self.from, self.before, self.v].map(|field| field.as_chunks::<LANES>().0);
        let [mut uphill, mut way] = [P::Wide::zero(); 2];
        for (group, ((from, before), v)) in from.iter().zip(before).zip(v).enumerate() {
            let (from, before, v) = (packs::<P>(from), packs::<P>(before), packs::<P>(v));
            let back = P::widen3(three!(|c| from[c] - v[c]));
            let on = P::widen3(three!(|c| v[c] - before[c]));
            let m = lanes_at::<P>(self.m, group).widen();
            uphill += m * dot(back, on);
            way += m * dot(back, back);
        }
        let [uphill, way] = lane_sums([uphill, way]);
        SweepSums { uphill, way }
    }
}

struct Extrapolate<'a, R: Real> {
    from: &'a mut [Padded<R>],
    before: &'a mut [Padded<R>],
    x: &'a mut [Padded<R>],
    v: &'a mut [Padded<R>],
    share: R,
    h: R,
}

impl<R: Real> WithSimd<R> for Extrapolate<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let Self { from, before, x, v, share, h } = self;
        let [from, before, x, v] = [from, before, x, v].map(|field| field.as_chunks_mut::<LANES>().0);
        for ((from, before), (x, v)) in from.iter_mut().zip(before).zip(x.iter_mut().zip(v)) {
            let (last, old, new) = (packs::<P>(before), packs::<P>(x), packs::<P>(v));
            let on = three!(|c| (new[c] - last[c]) * share);
            let beyond = three!(|c| new[c] + on[c]);
            store_padded(new, before);
            store_padded(beyond, v);
            store_padded(beyond, from);
            store_padded(three!(|c| old[c] + on[c] * h), x);
        }
    }
}

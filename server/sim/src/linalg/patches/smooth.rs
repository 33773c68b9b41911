//! The steps of a smoother before and after the coarse space, on one block of rows.

use crate::{
    linalg::{
        precondition::Inverse3,
        sixteens::{Sums, store_padded},
    },
    math::{LANES, Pack, Padded, Real, Sixteen, WithSimd, three},
};

/// z = w D⁻¹ r, padded too.
pub(super) struct Before<'a, R> {
    pub(super) inverse: &'a [Inverse3],
    /// w, in the precision of r.
    pub(super) damping: R,
    pub(super) r: &'a [Sixteen<R>],
    pub(super) z: &'a mut [Sixteen<R>],
    pub(super) p: &'a mut [Padded<R>],
}

impl<R: Real> WithSimd<R> for Before<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let padded = self.p.as_chunks_mut::<LANES>().0;
        for (((z, p), r), inverse) in self.z.iter_mut().zip(padded).zip(self.r).zip(self.inverse) {
            let step = inverse.times::<P>(r.load());
            let step = three!(|c| step[c] * self.damping);
            z.store(step);
            store_padded(step, p);
        }
    }
}

/// r - A z in the place of the product A z.
pub(super) struct Left<'a, R> {
    pub(super) r: &'a [Sixteen<R>],
    pub(super) product: &'a mut [Sixteen<R>],
}

impl<R: Real> WithSimd<R> for Left<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        for (product, r) in self.product.iter_mut().zip(self.r) {
            let (all, taken) = (r.load::<P>(), product.load::<P>());
            product.store(three!(|c| all[c] - taken[c]));
        }
    }
}

/// z += w D⁻¹ (r - A z), from the product A z. Returns r.z, and the sum of the magnitudes of its terms.
pub(super) struct After<'a, R> {
    pub(super) inverse: &'a [Inverse3],
    pub(super) damping: R,
    pub(super) r: &'a [Sixteen<R>],
    pub(super) product: &'a [Sixteen<R>],
    pub(super) z: &'a mut [Sixteen<R>],
}

impl<R: Real> WithSimd<R> for After<'_, R> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> [f64; 2] {
        let mut sums = Sums::<P::Wide>::zero();
        let rows = self.z.iter_mut().zip(self.product).zip(self.r).zip(self.inverse);
        for (((z, product), r), inverse) in rows {
            let (all, taken, old) = (r.load::<P>(), product.load::<P>(), z.load::<P>());
            let step = inverse.times::<P>(three!(|c| all[c] - taken[c]));
            let new = three!(|c| old[c] + step[c] * self.damping);
            z.store(new);
            sums.add(all, new);
        }
        sums.total()
    }
}

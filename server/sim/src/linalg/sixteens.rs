//! Work on one block of vectors in sixteens: sums of products, linear combinations, packing and back. Sums of
//! products and of their magnitudes are in binary64 and in a fixed order of lanes; sixteens are packed from
//! padded vectors.

use crate::math::{LANES, Pack, Padded, Real, Sixteen, WithSimd, dispatch, three};

/// The two sums of a block while it is gone through: a.b, and the sum of `|a_c b_c|` over components, the scale of the
/// rounding error of the first.
#[derive(Clone, Copy)]
pub(crate) struct Sums<W> {
    signed: W,
    magnitude: W,
}

impl<W: Pack<Number = f64>> Sums<W> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self { signed: W::zero(), magnitude: W::zero() }
    }

    /// Adds the products of sixteen vectors.
    #[inline(always)]
    pub(crate) fn add<P: Pack<Wide = W>>(&mut self, a: [P; 3], b: [P; 3]) {
        for c in 0..3 {
            let product = a[c].widen() * b[c].widen();
            self.signed += product;
            self.magnitude += product.abs();
        }
    }

    /// Adds the lanes.
    #[inline(always)]
    pub(crate) fn total(self) -> [f64; 2] {
        [add_lanes(self.signed.store()), add_lanes(self.magnitude.store())]
    }
}

/// Adds lanes in pairs.
#[inline(always)]
pub(crate) fn add_lanes(lanes: [f64; LANES]) -> f64 {
    let eight: [f64; 8] = std::array::from_fn(|i| lanes[i] + lanes[i + 8]);
    let four: [f64; 4] = std::array::from_fn(|i| eight[i] + eight[i + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}

/// The lanes of each of several packs, added in pairs. No closure: these are not compiled for the instructions of the kernel that calls them.
#[inline(always)]
pub(crate) fn lane_sums<W: Pack<Number = f64>, const N: usize>(packs: [W; N]) -> [f64; N] {
    let mut sums = [0.0; N];
    for i in 0..N {
        sums[i] = add_lanes(packs[i].store());
    }
    sums
}

/// The entries of sixteen matrices, in lanes, in binary64.
#[inline(always)]
pub(crate) fn widen_six<P: Pack>(lanes: &[[P::Number; LANES]; 6]) -> [P::Wide; 6] {
    let [a, b, c, d, e, f] = load_six::<P>(lanes);
    [a.widen(), b.widen(), c.widen(), d.widen(), e.widen(), f.widen()]
}

/// The same as they are.
#[inline(always)]
pub(crate) fn load_six<P: Pack>(lanes: &[[P::Number; LANES]; 6]) -> [P; 6] {
    [
        P::load(&lanes[0]),
        P::load(&lanes[1]),
        P::load(&lanes[2]),
        P::load(&lanes[3]),
        P::load(&lanes[4]),
        P::load(&lanes[5]),
    ]
}

/// Both sums over one block.
pub(crate) fn block_sums<R: Real>(a: &[Sixteen<R>], b: &[Sixteen<R>]) -> [f64; 2] {
    dispatch(BlockSums { a, b })
}

struct BlockSums<'a, R> {
    a: &'a [Sixteen<R>],
    b: &'a [Sixteen<R>],
}

impl<R: Real> WithSimd<R> for BlockSums<'_, R> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> [f64; 2] {
        let mut sums = Sums::<P::Wide>::zero();
        for (a, b) in self.a.iter().zip(self.b) {
            sums.add::<P>(a.load(), b.load());
        }
        sums.total()
    }
}

/// y -= t x over one block.
pub(crate) fn subtract_scaled<R: Real>(y: &mut [Sixteen<R>], t: R, x: &[Sixteen<R>]) {
    dispatch(SubtractScaled { y, t, x });
}

struct SubtractScaled<'a, R> {
    y: &'a mut [Sixteen<R>],
    t: R,
    x: &'a [Sixteen<R>],
}

impl<R: Real> WithSimd<R> for SubtractScaled<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        for (y, x) in self.y.iter_mut().zip(self.x) {
            let (old, x) = (y.load::<P>(), x.load::<P>());
            y.store(three!(|c| old[c] - x[c] * self.t));
        }
    }
}

/// x += alpha p, p = z + beta p over one block.
pub(crate) struct Turn<'a, R> {
    pub(crate) alpha: R,
    pub(crate) beta: R,
    pub(crate) x: &'a mut [Sixteen<R>],
    pub(crate) z: &'a [Sixteen<R>],
    pub(crate) p: &'a mut [Padded<R>],
}

impl<R: Real> WithSimd<R> for Turn<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        for ((x, z), p) in self.x.iter_mut().zip(self.z).zip(self.p.as_chunks_mut::<LANES>().0) {
            let old = packs::<P>(p);
            let (from, z) = (x.load::<P>(), z.load::<P>());
            x.store(three!(|c| from[c] + old[c] * self.alpha));
            store_padded(three!(|c| z[c] + old[c] * self.beta), p);
        }
    }
}

/// x += alpha p over one block.
pub(crate) fn add_scaled<R: Real>(x: &mut [Sixteen<R>], alpha: R, p: &[Padded<R>]) {
    dispatch(AddScaled { x, alpha, p });
}

struct AddScaled<'a, R> {
    x: &'a mut [Sixteen<R>],
    alpha: R,
    p: &'a [Padded<R>],
}

impl<R: Real> WithSimd<R> for AddScaled<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        for (x, p) in self.x.iter_mut().zip(self.p.as_chunks::<LANES>().0) {
            let (from, p) = (x.load::<P>(), packs::<P>(p));
            x.store(three!(|c| from[c] + p[c] * self.alpha));
        }
    }
}

/// Copies sixteens into padded vectors, over one block.
pub(crate) fn pad<R: Real>(from: &[Sixteen<R>], to: &mut [Padded<R>]) {
    dispatch(Pad { from, to });
}

struct Pad<'a, R> {
    from: &'a [Sixteen<R>],
    to: &'a mut [Padded<R>],
}

impl<R: Real> WithSimd<R> for Pad<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        for (from, to) in self.from.iter().zip(self.to.as_chunks_mut::<LANES>().0) {
            store_padded(from.load::<P>(), to);
        }
    }
}

/// Components of sixteen padded vectors.
#[inline(always)]
pub(crate) fn packs<P: Pack>(vectors: &[Padded<P::Number>; LANES]) -> [P; 3] {
    let [x, y, z, _] = P::columns(Padded::quads(vectors));
    [x, y, z]
}

/// Components of the vectors of a group among padded vectors. A closure in its place would not be compiled for the vector
/// instructions of its caller, nor for [`lanes_at`].
#[inline(always)]
pub(crate) fn packs_at<P: Pack>(field: &[Padded<P::Number>], group: usize) -> [P; 3] {
    packs(&field.as_chunks::<LANES>().0[group])
}

/// The numbers of a group among all.
#[inline(always)]
pub(crate) fn lanes_at<P: Pack>(field: &[P::Number], group: usize) -> P {
    P::load(&field.as_chunks::<LANES>().0[group])
}

/// Writes sixteen padded vectors from their components.
#[inline(always)]
pub(crate) fn store_padded<P: Pack>([x, y, z]: [P; 3], to: &mut [Padded<P::Number>; LANES]) {
    let quads = P::rows([x, y, z, P::zero()]);
    for (to, quad) in to.iter_mut().zip(&quads) {
        to.0 = *quad;
    }
}

/// Both sums of padded vectors and sixteens over one block.
pub(crate) fn sums_of_padded<R: Real>(p: &[Padded<R>], q: &[Sixteen<R>]) -> [f64; 2] {
    dispatch(SumsOfPadded { p, q })
}

struct SumsOfPadded<'a, R> {
    p: &'a [Padded<R>],
    q: &'a [Sixteen<R>],
}

impl<R: Real> WithSimd<R> for SumsOfPadded<'_, R> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> [f64; 2] {
        let mut sums = Sums::<P::Wide>::zero();
        for (p, q) in self.p.as_chunks::<LANES>().0.iter().zip(self.q) {
            sums.add::<P>(packs(p), q.load());
        }
        sums.total()
    }
}

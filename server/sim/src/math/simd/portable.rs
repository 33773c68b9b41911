//! Packs as arrays, in the target's baseline instructions: every other pack gives their bits.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::{
    super::real::{LANES, Lanes, Pack, Real, Record},
    operators::{itself, operators, own, whole},
};

/// Packs in the target's baseline instructions.
#[derive(Clone, Copy)]
pub(crate) struct Portable<R>([R; LANES]);

impl<R: Real> Portable<R> {
    #[inline(always)]
    fn map(self, f: impl Fn(R) -> R) -> Self {
        let mut lanes = self.0;
        for lane in &mut lanes {
            *lane = f(*lane);
        }
        Self(lanes)
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(R, R) -> R) -> Self {
        let mut lanes = self.0;
        for lane in 0..LANES {
            lanes[lane] = f(lanes[lane], other.0[lane]);
        }
        Self(lanes)
    }
}

operators! {
    [R: Real] Portable<R>, R;
    |a, b| + a.zip(b, |a, b| a + b), - a.zip(b, |a, b| a - b), * a.zip(b, |a, b| a * b), / a.zip(b, |a, b| a / b)
}

own!([R: Real] Portable<R>, R, |records, indices| {
    let mut lanes = [[[R::zero(); LANES]; 3]; 2];
    for lane in 0..LANES {
        // SAFETY: the caller promises that the index is in range.
        let record = unsafe { records.get_unchecked(indices[lane] as usize) };
        for (lanes, vector) in lanes.iter_mut().zip(&record.0) {
            for c in 0..3 {
                lanes[c][lane] = vector.0[c];
            }
        }
    }
    lanes.map(|vector| vector.map(Self))
});

impl<R: Real> Pack for Portable<R> {
    itself!();
    type Wide = Portable<f64>;

    #[inline(always)]
    fn splat(value: R) -> Self {
        Self([value; LANES])
    }
    #[inline(always)]
    fn load(values: &[R; LANES]) -> Self {
        Self(*values)
    }
    #[inline(always)]
    fn store(self) -> [R; LANES] {
        self.0
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(R::sqrt)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(|x| if x > R::zero() { x } else { R::zero() - x })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // As the processors' instruction: the second where the first is not greater.
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn inverse_above(self, least: Self) -> Self {
        self.zip(least, |x, least| if x > least { R::one() / x } else { R::zero() })
    }
    #[inline(always)]
    fn where_positive(self, gate: Self) -> Self {
        self.zip(gate, |x, gate| if gate > R::zero() { x } else { R::zero() })
    }
    #[inline(always)]
    fn widen(self) -> Portable<f64> {
        Portable(self.0.map(R::to_f64))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn floor(self) -> Self {
        self.map(R::floor)
    }
    #[inline(always)]
    fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
        let mut lanes = otherwise.0;
        for lane in 0..LANES {
            if self.0[lane] < other.0[lane] {
                lanes[lane] = then.0[lane];
            }
        }
        Self(lanes)
    }
    #[inline(always)]
    fn with_sign_of(self, other: Self) -> Self {
        self.zip(other, R::copysign)
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.map(R::power_of_two)
    }
    #[inline(always)]
    fn whole(self) -> [u16; LANES] {
        let mut whole = [0; LANES];
        for lane in 0..LANES {
            whole[lane] = self.0[lane].to_f64() as u16;
        }
        whole
    }
    #[inline(always)]
    fn repeat(quad: &[R; 4]) -> Self {
        let mut lanes = [quad[0]; LANES];
        for lane in 0..LANES {
            lanes[lane] = quad[lane % 4];
        }
        Self(lanes)
    }
    #[inline(always)]
    fn spread(quad: &[R; 4]) -> Self {
        let mut lanes = [quad[0]; LANES];
        for lane in 0..LANES {
            lanes[lane] = quad[lane / 4];
        }
        Self(lanes)
    }
    #[inline(always)]
    fn fold(self) -> [R; 4] {
        let mut sums = [R::zero(); 4];
        for c in 0..4 {
            sums[c] = (self.0[c] + self.0[c + 8]) + (self.0[c + 4] + self.0[c + 12]);
        }
        sums
    }
    #[inline(always)]
    fn columns(quads: &[[R; 4]; LANES]) -> [Self; 4] {
        let mut columns = [[R::zero(); LANES]; 4];
        for lane in 0..LANES {
            for c in 0..4 {
                columns[c][lane] = quads[lane][c];
            }
        }
        columns.map(Self)
    }
    #[inline(always)]
    fn rows(columns: [Self; 4]) -> [[R; 4]; LANES] {
        let mut quads = [[R::zero(); 4]; LANES];
        for lane in 0..LANES {
            for c in 0..4 {
                quads[lane][c] = columns[c].0[lane];
            }
        }
        quads
    }
}

/// Quads of a pack by way of memory: binary64 is for accuracy.
macro_rules! quads_by_lanes {
    ($number:ty) => {
        #[inline(always)]
        fn repeat(quad: &[$number; 4]) -> Self {
            Self::load(&Portable::repeat(quad).store())
        }
        #[inline(always)]
        fn spread(quad: &[$number; 4]) -> Self {
            Self::load(&Portable::spread(quad).store())
        }
        #[inline(always)]
        fn fold(self) -> [$number; 4] {
            Portable::load(&self.store()).fold()
        }
        #[inline(always)]
        fn columns(quads: &[[$number; 4]; LANES]) -> [Self; 4] {
            let [a, b, c, d] = Portable::columns(quads);
            [Self::load(&a.store()), Self::load(&b.store()), Self::load(&c.store()), Self::load(&d.store())]
        }
        #[inline(always)]
        fn rows(columns: [Self; 4]) -> [[$number; 4]; LANES] {
            let [a, b, c, d] = columns;
            Portable::rows([
                Portable::load(&a.store()),
                Portable::load(&b.store()),
                Portable::load(&c.store()),
                Portable::load(&d.store()),
            ])
        }
    };
}
#[cfg(target_arch = "x86_64")]
pub(super) use quads_by_lanes;

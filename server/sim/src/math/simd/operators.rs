//! The operators of packs: `a + b`, `a * 0.5`, `-a`, `a += b`.

/// Operators of a pack from its four operations, each with a pack and with a number on the right.
macro_rules! operators {
    ([$($generics:tt)*] $pack:ty, $number:ty;
     |$a:ident, $b:ident| + $sum:expr, - $difference:expr, * $product:expr, / $quotient:expr) => {
        operators!([$($generics)*] $pack, $number; Add, add: |$a, $b| $sum);
        operators!([$($generics)*] $pack, $number; Sub, sub: |$a, $b| $difference);
        operators!([$($generics)*] $pack, $number; Mul, mul: |$a, $b| $product);
        operators!([$($generics)*] $pack, $number; Div, div: |$a, $b| $quotient);

        impl<$($generics)*> Neg for $pack {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self::zero() - self
            }
        }
        impl<$($generics)*> AddAssign for $pack {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }
        impl<$($generics)*> SubAssign for $pack {
            #[inline(always)]
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }
    };
    ([$($generics:tt)*] $pack:ty, $number:ty; $operator:ident, $apply:ident: |$a:ident, $b:ident| $value:expr) => {
        impl<$($generics)*> $operator for $pack {
            type Output = Self;
            #[inline(always)]
            fn $apply(self, other: Self) -> Self {
                let ($a, $b) = (self, other);
                $value
            }
        }
        impl<$($generics)*> $operator<$number> for $pack {
            type Output = Self;
            #[inline(always)]
            fn $apply(self, number: $number) -> Self {
                self.$apply(Self::splat(number))
            }
        }
    };
}
pub(super) use operators;

/// Sixteen lanes as the one part of themselves, from `gather(records, indices)`.
macro_rules! whole {
    ([$($generics:tt)*] $pack:ty, $number:ty, |$records:ident, $indices:ident| $gather:expr) => {
        impl<$($generics)*> Lanes for $pack {
            type Number = $number;
            const PARTS: usize = 1;

            #[inline(always)]
            fn load_part(values: &[$number; LANES], _: usize) -> Self {
                Self::load(values)
            }
            #[inline(always)]
            fn store_part(self, values: &mut [$number; LANES], _: usize) {
                *values = self.store();
            }
            #[inline(always)]
            #[allow(unsafe_code, reason = "the caller promises indices in range")]
            unsafe fn gather_part(
                $records: &[Record<$number>],
                $indices: &[u16; LANES],
                _: usize,
            ) -> [[Self; 3]; 2] {
                $gather
            }
        }
    };
}
pub(super) use whole;

/// Sixteen lanes as a register of their own: one, or as much as one.
macro_rules! own {
    ([$($generics:tt)*] $pack:ty, $number:ty, |$records:ident, $indices:ident| $gather:expr) => {
        whole!([$($generics)*] $pack, $number, |$records, $indices| $gather);

        impl<$($generics)*> $crate::math::Register for $pack {
            #[inline(always)]
            fn splat(value: $number) -> Self {
                Pack::splat(value)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Pack::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Pack::abs(self)
            }
            #[inline(always)]
            fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
                Pack::if_less(self, other, then, otherwise)
            }
            #[inline(always)]
            fn with_sign_of(self, other: Self) -> Self {
                Pack::with_sign_of(self, other)
            }
            #[inline(always)]
            fn any(self) -> bool {
                Pack::any(self)
            }
        }
    };
}
pub(super) use own;

/// The registers of a pack that is its own.
macro_rules! itself {
    () => {
        type Register = Self;

        #[inline(always)]
        fn register(self, _: usize) -> Self {
            self
        }
        #[inline(always)]
        fn set_register(&mut self, _: usize, lanes: Self) {
            *self = lanes;
        }
    };
}
pub(super) use itself;

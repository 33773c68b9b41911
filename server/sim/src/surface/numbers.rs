//! Numbers and places for tests, the same in every run.

use crate::math::Vec3;

/// A sequence of numbers from -1 to 1.
pub(super) struct Numbers(pub(super) u64);

impl Numbers {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// A place in the cube from -1 to 1.
    pub(super) fn place(&mut self) -> Vec3<f64> {
        Vec3::new(self.next(), self.next(), self.next())
    }

    pub(super) fn places<const N: usize>(&mut self) -> [Vec3<f64>; N] {
        std::array::from_fn(|_| self.place())
    }
}

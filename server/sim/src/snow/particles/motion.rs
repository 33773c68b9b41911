//! How the particles of a group move, as it is stored.

use crate::math::{LANES, Pack, Real};

/// Positions, masses, velocities and J_P of a group, as they are stored.
#[derive(Clone, Copy)]
pub(crate) struct Motion<R> {
    /// Position and mass; velocity and J_P: a quad per particle.
    quads: [[[R; 4]; LANES]; 2],
}

impl<R: Real> Motion<R> {
    /// To be filled: all numbers are 0.
    pub(crate) fn new() -> Self {
        Self { quads: [[[R::zero(); 4]; LANES]; 2] }
    }

    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, pair: [[R; 4]; 2]) {
        (self.quads[0][lane], self.quads[1][lane]) = (pair[0], pair[1]);
    }

    /// Position (m) and mass (kg) of one particle of the group.
    pub(crate) fn of_one(&self, lane: usize) -> ([R; 3], R) {
        let [x, y, z, m] = self.quads[0][lane];
        ([x, y, z], m)
    }

    /// Positions (m) and masses (kg).
    #[inline(always)]
    pub(crate) fn x_and_mass<P: Pack<Number = R>>(&self) -> ([P; 3], P) {
        let [x, y, z, mass] = P::columns(&self.quads[0]);
        ([x, y, z], mass)
    }

    /// Velocities (m/s) and J_P.
    #[inline(always)]
    pub(crate) fn v_and_plastic_ratio<P: Pack<Number = R>>(&self) -> ([P; 3], P) {
        let [x, y, z, plastic_ratio] = P::columns(&self.quads[1]);
        ([x, y, z], plastic_ratio)
    }
}

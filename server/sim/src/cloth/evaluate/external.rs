//! What acts on each particle by itself, beside gravity and drag: the air, frozen at a state, and forces that are given.
//!
//! A particle feels f - B (v - w): f a force that is constant over the step, w the velocity of the medium, and B a third of D of
//! each of its triangles (`laws/air.rs`), symmetric and never negative. So a step takes the air as it takes drag.

use crate::{
    linalg::load_six,
    math::{LANES, Mat3, Pack, Real, Sixteen, Vec3, array::dot, three},
};

/// Of all particles, sixteen at a time.
#[derive(Clone, Debug, PartialEq, Default)]
pub(crate) struct External<R: Real> {
    /// B (N s/m): xx, yy, zz, xy, xz, yz; empty without air.
    pub(crate) air: Vec<[[R; LANES]; 6]>,
    /// f (N); empty where there are none.
    pub(crate) forces: Vec<Sixteen<R>>,
    /// Sum of the lengths of all f (N).
    pub(crate) force_sum: f64,
}

impl<R: Real> External<R> {
    /// Whether nothing acts on any particle.
    pub(crate) fn is_empty(&self) -> bool {
        self.air.is_empty() && self.forces.is_empty()
    }

    /// What acts on sixteen particles; none where nothing does on any particle.
    #[inline(always)]
    pub(crate) fn at<P: Pack<Number = R>>(&self, place: usize) -> Option<Acting<P>> {
        if self.is_empty() {
            return None;
        }
        // No calls of functions that are given: they would not be compiled for the instructions of the kernel.
        let air = match self.air.get(place) {
            Some(air) => load_six(air),
            None => [P::zero(); 6],
        };
        let force = match self.forces.get(place) {
            Some(force) => force.load(),
            None => [P::zero(); 3],
        };
        Some(Acting { air, force })
    }

    /// f (N) of a particle, where forces are given.
    pub(crate) fn force_on(&self, particle: usize) -> Option<Vec3<R>> {
        Some(self.forces.get(particle / LANES)?.get(particle % LANES))
    }

    /// B (N s/m) of a particle, where there is air.
    pub(crate) fn air_of(&self, particle: usize) -> Option<Mat3<R>> {
        let [xx, yy, zz, xy, xz, yz] = self.air.get(particle / LANES)?.map(|lanes| lanes[particle % LANES]);
        Some(symmetric([xx, yy, zz, xy, xz, yz]))
    }
}

/// A symmetric matrix from its entries: xx, yy, zz, xy, xz, yz.
pub(crate) fn symmetric<R: Real>([xx, yy, zz, xy, xz, yz]: [R; 6]) -> Mat3<R> {
    Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// B and f of sixteen particles.
#[derive(Clone, Copy)]
pub(crate) struct Acting<P> {
    pub(crate) air: [P; 6],
    pub(crate) force: [P; 3],
}

impl<P: Pack> Acting<P> {
    #[inline(always)]
    pub(crate) fn widen(&self) -> Acting<P::Wide> {
        let [a, b, c, d, e, f] = self.air;
        let air = [a.widen(), b.widen(), c.widen(), d.widen(), e.widen(), f.widen()];
        Acting { air, force: P::widen3(self.force) }
    }

    /// Adds B times a number to the entries of symmetric matrices: xx, yy, zz, xy, xz, yz.
    #[inline(always)]
    pub(crate) fn add_to(&self, matrix: &mut [P; 6], scale: P) {
        for c in 0..6 {
            matrix[c] += self.air[c] * scale;
        }
    }

    /// B v: what the air takes of a velocity (N).
    #[inline(always)]
    pub(crate) fn slowing(&self, [x, y, z]: [P; 3]) -> [P; 3] {
        let [xx, yy, zz, xy, xz, yz] = self.air;
        [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z]
    }

    /// f + B w, for a medium of this velocity.
    #[inline(always)]
    pub(crate) fn push(&self, wind: [P; 3]) -> [P; 3] {
        let carried = self.slowing(wind);
        three!(|c| self.force[c] + carried[c])
    }

    /// f - B (v - w).
    #[inline(always)]
    pub(crate) fn force(&self, v: [P; 3], wind: [P; 3]) -> [P; 3] {
        let slowing = self.slowing(three!(|c| v[c] - wind[c]));
        three!(|c| self.force[c] - slowing[c])
    }

    /// v.B v, and v.(f + B w): what B takes of the power at a velocity, and what is given.
    #[inline(always)]
    pub(crate) fn powers(&self, v: [P; 3], wind: [P; 3]) -> [P; 2] {
        [dot(v, self.slowing(v)), dot(v, self.push(wind))]
    }
}

//! What an evaluation adds up over particles: energies, momentum, and what judges the step that comes next.

use super::{external::Acting, numbers::StepNumbers};
use crate::{
    cloth::settings::{Aim, RightHandSide},
    linalg::add_lanes,
    math::{LANES, Pack, Real, array::dot, array3},
};

/// Sums of a block, in the order of [`Total`], and the greatest component of a position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Partial {
    pub(crate) sums: [f64; SUMS],
    /// The largest length over rest length.
    pub(crate) stretch: f64,
    /// The largest component of any position (m), without its sign.
    pub(crate) largest_coordinate: f64,
}

/// Sums that a block makes.
pub(crate) const SUMS: usize = 10;

/// Sums over all blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Total {
    pub(crate) kinetic_energy: f64,
    pub(crate) elastic_energy: f64,
    pub(crate) gravitational_energy: f64,
    pub(crate) momentum: [f64; 3],
    /// Of a step from the state: h F.v less (h C v + h² K v).v, and h F.v (J), over all particles, K and C frozen. Of an
    /// iterate: the potentials (J) of the medium, h c |v|² / 2 - h c v.w, and of damping, h v.C v / 2. Of an explicit step with
    /// a bound: the power (W) of the medium, c v.w - c |v|².
    rates: [f64; 2],
    /// With a matrix: the work (J) that pins on their way do in h, by the forces at its end. Of an explicit step with a bound:
    /// their power (W).
    pub(crate) pin_work: f64,
}

impl Total {
    /// From the sums of all blocks. A position that is not finite may not reach an energy (no spring, no gravity): the
    /// checksum is 0 or NaN, and makes the kinetic energy NaN.
    pub(crate) fn of(sums: [f64; SUMS]) -> Self {
        let [kinetic, elastic_energy, gravitational_energy, px, py, pz, all, straight, pins, checksum] = sums;
        Self {
            kinetic_energy: kinetic + checksum,
            elastic_energy,
            gravitational_energy,
            momentum: [px, py, pz],
            rates: [all, straight],
            pin_work: -pins,
        }
    }

    /// Elastic and gravitational energy (J).
    pub(crate) fn potential(&self) -> f64 {
        self.elastic_energy + self.gravitational_energy
    }

    /// Of a step from the state: how much the potential falls to second order if all goes on at its velocity (J): h F.v
    /// - v.(h C + h² K) v / 2.
    pub(crate) fn slope(&self) -> f64 {
        0.5 * (self.rates[0] + self.rates[1])
    }

    /// Of an explicit step with a bound: the power (W) by which pins and the medium add energy.
    pub(crate) fn power(&self) -> f64 {
        self.pin_work.max(0.0) + self.rates[0].max(0.0)
    }

    /// Kinetic, elastic and gravitational energy (J).
    pub(crate) fn energy(&self) -> f64 {
        self.kinetic_energy + self.potential()
    }

    /// Of an iterate: the potential (J) of damping and medium.
    pub(crate) fn dissipation(&self) -> f64 {
        self.rates[0] + self.rates[1]
    }
}

/// Sums over the particles of a block, in lanes.
pub(crate) struct Figures<W> {
    gravity: [W; 3],
    wind: [W; 3],
    /// h, and the drag, times h but for an explicit step.
    h: W,
    drag: W,
    kinetic: W,
    gravitational: W,
    momentum: [W; 3],
    /// Of a step from the state: rows of the right-hand side times velocities; of an iterate the potential of the medium.
    all: W,
    /// Rows of pins times their velocities.
    pins: W,
    /// Of a step from the state: h F.v of gravity and medium.
    straight: W,
    largest_coordinate: W,
    checksum: W,
}

impl<W: Pack<Number = f64>> Figures<W> {
    #[inline(always)]
    pub(crate) fn new<R: Real, A: Aim>(numbers: &StepNumbers<R>) -> Self {
        let zero = W::zero();
        Self {
            gravity: array3(&numbers.gravity).map(W::splat),
            wind: array3(&numbers.wind).map(W::splat),
            h: W::of(numbers.scheme.h),
            drag: W::of(if A::HAS_MATRIX { numbers.scheme.h } else { 1.0 } * numbers.drag.to_f64()),
            kinetic: zero,
            gravitational: zero,
            momentum: [zero; 3],
            all: zero,
            pins: zero,
            straight: zero,
            largest_coordinate: zero,
            checksum: zero,
        }
    }

    /// Adds sixteen particles of these free masses (kg).
    #[inline(always)]
    pub(crate) fn add(&mut self, [x, v]: [[W; 3]; 2], m: W) {
        self.kinetic += W::of(0.5) * m * dot(v, v);
        self.gravitational -= m * dot(self.gravity, x);
        for c in 0..3 {
            self.momentum[c] += m * v[c];
        }
        self.largest_coordinate = self.largest_coordinate.max(x[0].abs()).max(x[1].abs()).max(x[2].abs());
        self.checksum += (x[0] + x[1] + x[2] + v[0] + v[1] + v[2]) * W::zero();
    }

    /// Adds what the velocities of sixteen particles predict: `springs` is what springs and elements add to the
    /// right-hand side of their rows (N s), pins included; `inv_m` (1/kg) is 0 for these.
    #[inline(always)]
    pub(crate) fn predict(
        &mut self,
        side: RightHandSide,
        v: [W; 3],
        springs: [W; 3],
        [m, inv_m]: [W; 2],
        acting: Option<Acting<W>>,
    ) {
        let [push, square] = [dot(springs, v), dot(v, v)];
        let (mut taken, mut given) = (self.drag * square, self.drag * dot(self.wind, v));
        if let Some(acting) = acting {
            let [of_air, of_all] = acting.powers(v, self.wind);
            (taken, given) = (taken + self.h * of_air, given + self.h * of_all);
        }
        if side == RightHandSide::Forces {
            self.all += (W::of(0.5) * taken - given).where_positive(inv_m);
            self.pins += push - push.where_positive(inv_m);
            return;
        }
        let own = self.h * m * dot(self.gravity, v) + given.where_positive(inv_m);
        self.all += push + own - taken.where_positive(inv_m);
        self.pins += push - push.where_positive(inv_m);
        self.straight += own;
    }

    /// Adds by how much pins and the medium change the energy of sixteen particles: `springs` is what springs and elements push
    /// them with (N), pins included.
    #[inline(always)]
    pub(crate) fn work(&mut self, v: [W; 3], springs: [W; 3], inv_m: W) {
        let push = dot(springs, v);
        self.pins += push - push.where_positive(inv_m);
        self.all += (self.drag * (dot(self.wind, v) - dot(v, v))).where_positive(inv_m);
    }

    /// The sums of the block, with those of its springs.
    #[inline(always)]
    pub(crate) fn partial(self, [elastic, straight]: [f64; 2], stretch: f64) -> Partial {
        let total = |lanes: W| add_lanes(lanes.store());
        let [px, py, pz] = self.momentum.map(total);
        let [kinetic, gravitational, checksum] = [self.kinetic, self.gravitational, self.checksum].map(total);
        let [all, pins, own] = [self.all, self.pins, self.straight].map(total);
        let sums = [kinetic, elastic, gravitational, px, py, pz, all, own + straight, pins, checksum];
        let coordinates = self.largest_coordinate.store();
        let largest_coordinate = (0..LANES).fold(0.0, |greatest, lane| f64::max(greatest, coordinates[lane]));
        Partial { sums, stretch, largest_coordinate }
    }
}

//! What an evaluation adds up over particles: energies, momentum, and what judges the step that comes next.

use super::{external::Medium, numbers::StepNumbers};
use crate::{
    cloth::settings::RightHandSide,
    linalg::lane_sums,
    math::{LANES, Pack, Real, Vec3, array::dot, array3, three},
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
pub(crate) const SUMS: usize = 18;

/// Sums over all blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Total {
    pub(crate) kinetic_energy: f64,
    pub(crate) elastic_energy: f64,
    pub(crate) gravitational_energy: f64,
    pub(crate) momentum: [f64; 3],
    /// Of a step from the state: h F.v less (h C v + h² K v).v, and h F.v (J), over all particles, K and C frozen. Of an
    /// iterate: the potentials (J) of the medium, h c |v|² / 2 - h c v.w, and of damping, h v.C v / 2.
    rates: [f64; 2],
    /// With a matrix: the work (J) that pins on their way do in h, by the forces at its end. Of an explicit step with a bound:
    /// their power (W).
    pin_work: f64,
    /// What springs and elements push all pins with (N); with a matrix times h (N s).
    pin_push: [f64; 3],
    /// Of an explicit step with a bound: m a.v (W), m |a|² (J/s²) and m a (N).
    pub(crate) swings: [f64; 5],
}

impl Total {
    /// From the sums of all blocks. A position that is not finite may not reach an energy (no spring, no gravity): the
    /// checksum is 0 or NaN, and makes the kinetic energy NaN.
    pub(crate) fn of(sums: [f64; SUMS]) -> Self {
        let [
            kinetic,
            elastic_energy,
            gravitational_energy,
            px,
            py,
            pz,
            all,
            straight,
            pins,
            checksum,
            rest @ ..,
        ] = sums;
        let [push_x, push_y, push_z, swings @ ..] = rest;
        Self {
            kinetic_energy: kinetic + checksum,
            elastic_energy,
            gravitational_energy,
            momentum: [px, py, pz],
            rates: [all, straight],
            pin_work: -pins,
            pin_push: [push_x, push_y, push_z],
            swings,
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

    /// The work of pins (J), or their power (W), as it is seen from what moves with a velocity (m/s).
    pub(crate) fn pin_work_from(&self, frame: Vec3<f64>) -> f64 {
        self.pin_work + Vec3::from(self.pin_push).dot(&frame)
    }

    /// What pins give what goes along with a velocity (m/s) as a whole: their power (W), with a matrix their work (J).
    pub(crate) fn pins_along(&self, velocity: Vec3<f64>) -> f64 {
        -Vec3::from(self.pin_push).dot(&velocity)
    }

    /// Kinetic and elastic energy (J).
    pub(crate) fn moved(&self) -> f64 {
        self.kinetic_energy + self.elastic_energy
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
    h: W,
    kinetic: W,
    gravitational: W,
    momentum: [W; 3],
    /// Of a step from the state: rows of the right-hand side times velocities; of an iterate the potential of the medium.
    all: W,
    /// Rows of pins times their velocities, and their sum.
    pins: W,
    pin_push: [W; 3],
    /// Of an explicit step with a bound: m a.v, m |a|² and m a.
    swings: [W; 5],
    /// Of a step from the state: h F.v of gravity and medium.
    straight: W,
    largest_coordinate: W,
    checksum: W,
}

impl<W: Pack<Number = f64>> Figures<W> {
    #[inline(always)]
    pub(crate) fn new<R: Real>(numbers: &StepNumbers<R>) -> Self {
        let zero = W::zero();
        let gravity = array3(&numbers.gravity);
        Self {
            gravity: three!(|c| W::splat(gravity[c])),
            h: W::of(numbers.scheme.h),
            kinetic: zero,
            gravitational: zero,
            momentum: [zero; 3],
            all: zero,
            pins: zero,
            pin_push: [zero; 3],
            swings: [zero; 5],
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
        medium: &Medium<W>,
    ) {
        let (push, [taken, given]) = (dot(springs, v), medium.powers(v, self.h));
        self.push_pins(springs, inv_m);
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

    /// Adds by how much pins change the energy of sixteen particles of these free masses (kg): `springs` is what springs and
    /// elements push them with (N), pins included; and what their energy swings by, from their accelerations (m/s²).
    #[inline(always)]
    pub(crate) fn work(&mut self, v: [W; 3], springs: [W; 3], a: [W; 3], [m, inv_m]: [W; 2]) {
        let push = dot(springs, v);
        self.pins += push - push.where_positive(inv_m);
        self.swings[0] += m * dot(a, v);
        self.swings[1] += m * dot(a, a);
        for c in 0..3 {
            self.swings[2 + c] += m * a[c];
        }
    }

    /// Adds what springs and elements push pins among sixteen particles with.
    #[inline(always)]
    pub(crate) fn push_pins(&mut self, springs: [W; 3], inv_m: W) {
        for c in 0..3 {
            self.pin_push[c] += springs[c] - springs[c].where_positive(inv_m);
        }
    }

    /// The sums of the block, with those of its springs.
    #[inline(always)]
    pub(crate) fn partial(self, [elastic, straight]: [f64; 2], stretch: f64) -> Partial {
        let [px, py, pz] = lane_sums(self.momentum);
        let [kinetic, gravitational, checksum] = lane_sums([self.kinetic, self.gravitational, self.checksum]);
        let [all, pins, own] = lane_sums([self.all, self.pins, self.straight]);
        let [push_x, push_y, push_z] = lane_sums(self.pin_push);
        let [along, square, ax, ay, az] = lane_sums(self.swings);
        let straight = own + straight;
        let energies = [kinetic, elastic, gravitational];
        let others =
            [px, py, pz, all, straight, pins, checksum, push_x, push_y, push_z, along, square, ax, ay, az];
        let mut sums = [0.0; SUMS];
        sums[..3].copy_from_slice(&energies);
        sums[3..].copy_from_slice(&others);
        let coordinates = self.largest_coordinate.store();
        let largest_coordinate = (0..LANES).fold(0.0, |greatest, lane| f64::max(greatest, coordinates[lane]));
        Partial { sums, stretch, largest_coordinate }
    }
}

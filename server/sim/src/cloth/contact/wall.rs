//! A particle and a collider as a pair: the solve knows colliders, else each step would press a pile together by its weight.
//!
//! Their rule after the solve stays; Coulomb's bound takes the impulse that the solve gave.

use super::{
    pair::Activity,
    ways::{Ways, wide},
};
use crate::{
    cloth::layout::Model,
    collide::{Collider, Felt, push_and_rub},
    math::{Padded, Real, Vec3, array3, vec3},
};

/// As those of a pair of parts of the surface.
const STIFFNESS: f64 = 100.0;
const REGAINED: f64 = 0.1;
const PULL: f64 = 0.02;
const SHORT: f64 = 0.01;

/// A particle near a collider in a sub-step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wall {
    pub(crate) particle: u32,
    pub(crate) collider: u32,
    /// Out of the collider: a unit vector.
    pub(crate) normal: Vec3<f64>,
    /// Velocity of the surface (m/s).
    pub(crate) velocity: Vec3<f64>,
    /// Distance from where it touches at the start, and the gap that the solve aims at (m).
    pub(crate) gap: f64,
    pub(crate) target: f64,
    /// h² k (kg).
    pub(crate) stiffness: f64,
    pub(crate) activity: Activity,
    /// How fast (m/s) the last solve pushed it.
    pub(crate) pushed: f64,
}

/// When and for how long a sub-step is: its length and the time at its end (s).
#[derive(Clone, Copy, Debug)]
pub(crate) struct When {
    pub(crate) dt: f64,
    pub(crate) end: f64,
}

impl Wall {
    /// All of a block that could meet within a sub-step, particle by particle.
    pub(crate) fn list<R: Real>(
        model: &Model<R>,
        block: usize,
        colliders: &[Collider],
        (x, ways, reach): (&[Padded<R>], &Ways, f64),
        When { dt, end }: When,
        out: &mut Vec<Self>,
    ) {
        let first = block * model.block_size;
        for row in first..(first + model.block_size).min(model.count) {
            let inv_m = model.inv_m[row].to_f64();
            if inv_m == 0.0 {
                continue;
            }
            let (at, way) = (wide(&x[row]), ways.of(x, row as u32));
            for (number, collider) in colliders.iter().enumerate() {
                let (distance, normal) = collider.distance(array3(&at), end - dt);
                let gap = distance - collider.margin;
                let velocity = vec3(collider.velocity_at(array3(&at), end - dt));
                let relative = way - velocity * dt;
                if gap > relative.norm() + reach {
                    continue;
                }
                let normal = vec3(normal);
                let target = if gap < 0.0 { gap - REGAINED * gap } else { 0.0 };
                let is_met = gap + relative.dot(&normal) < target;
                out.push(Self {
                    particle: row as u32,
                    collider: number as u32,
                    normal,
                    velocity,
                    gap,
                    target,
                    stiffness: STIFFNESS / inv_m,
                    activity: if is_met { Activity::Active } else { Activity::Idle },
                    pushed: 0.0,
                });
            }
        }
    }

    /// The linear gap (m) after `dt` seconds with a velocity (m/s).
    pub(crate) fn gap_after(&self, velocity: &Vec3<f64>, dt: f64) -> f64 {
        self.gap + dt * (velocity - self.velocity).dot(&self.normal)
    }

    /// h times the force (N s) with which it pushes.
    pub(crate) fn impulse(&self, velocity: &Vec3<f64>, dt: f64) -> f64 {
        self.stiffness / dt * (self.target - self.gap_after(velocity, dt))
    }

    /// Energy (J) of its push.
    pub(crate) fn energy(&self, velocity: &Vec3<f64>, dt: f64) -> f64 {
        let short = self.target - self.gap_after(velocity, dt);
        0.5 * self.stiffness / (dt * dt) * short * short
    }

    /// Drops it where it pulls, adds it where it falls short, by shares of the thickness; whether that changed anything.
    pub(crate) fn review(&mut self, velocity: &Vec3<f64>, dt: f64, thickness: f64) -> bool {
        let gap = self.gap_after(velocity, dt);
        let next = match self.activity {
            Activity::Active if gap > self.target + PULL * thickness => Activity::Dropped,
            Activity::Idle if gap < self.target - SHORT * thickness => Activity::Active,
            Activity::Dropped if gap < self.target - SHORT * thickness => Activity::Again,
            same => same,
        };
        std::mem::replace(&mut self.activity, next) != next
    }

    /// Keeps how fast (m/s) the solve that led to a velocity (m/s) pushed the particle, of mass 1 / `inv_m`.
    pub(crate) fn keep_push(&mut self, velocity: &Vec3<f64>, dt: f64, inv_m: f64) {
        self.pushed = if self.activity.pushes() { self.impulse(velocity, dt) * inv_m } else { 0.0 };
    }

    /// Rubs the particle, of mass 1 / `inv_m`, that went from `start` (m) in `dt` (s) and ends at `x` (m) with a velocity `v` (m/s), by what the
    /// solve pushed it with; the collider feels the impulses of both. Whether that moved it.
    pub(crate) fn rub(
        &self,
        collider: &Collider,
        (start, inv_m, dt): (&Vec3<f64>, f64, f64),
        [x, v]: [&mut Vec3<f64>; 2],
        felt: &mut Felt,
    ) -> bool {
        // A pair that pulls, within what is allowed, has nothing to rub with.
        let push = self.pushed.max(0.0);
        let slowing = push_and_rub(collider, &(*v - self.velocity), &self.normal, push) - self.normal * push;
        felt.take(collider, array3(&((self.normal * self.pushed + slowing) / inv_m)), array3(x));
        if slowing == Vec3::zeros() {
            return false;
        }
        *v += slowing;
        *x = start + *v * dt;
        true
    }
}

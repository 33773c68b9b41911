//! A particle and a collider as a pair: the solve knows colliders, else each step would press a pile together by its weight.
//!
//! Their rule after the solve stays; Coulomb's bound takes the impulse that the solve gave.

use super::{
    pair::{Activity, CREEP, HARDER, PULL, REGAINED, SHORT, STIFFNESS},
    ways::{Ways, wide},
};
use crate::{
    cloth::layout::Model,
    collide::{Collider, Felt, push_and_rub},
    math::{Padded, Real, Vec3, array3, vec3},
};

/// h times friction over speed, over the mass, at most: what sticks.
const STUCK: f64 = 1e4;
/// Share of the thickness that a particle may be in a collider before its pair is made harder.
const DEEP: f64 = 0.1;
/// Change of friction, over both values, that calls for another solve.
const RUB_CHANGE: f64 = 0.2;

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
    /// Friction: h times force over speed (kg).
    pub(crate) rub: f64,
    /// How fast (m/s) the last solve pushed it.
    pub(crate) pushed: f64,
    /// By how much (m/s) its friction slowed it.
    slowed: Vec3<f64>,
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
        (x, ways): (&[Padded<R>], &Ways),
        When { dt, end }: When,
        out: &mut Vec<Self>,
    ) {
        let first = block * model.block_size;
        for row in first..(first + model.block_size).min(model.count) {
            let inv_m = model.inv_m[row].to_f64();
            if inv_m == 0.0 {
                continue;
            }
            let (at, way, expected) = (wide(&x[row]), ways.free(row as u32), ways.expected(row as u32));
            for (number, collider) in colliders.iter().enumerate() {
                let (distance, normal) = collider.distance(array3(&at), end - dt);
                let gap = distance - collider.margin;
                let velocity = vec3(collider.velocity_at(array3(&at), end - dt));
                let room = (expected - velocity * dt).norm() + ways.reach(row as u32);
                if gap > room {
                    continue;
                }
                let relative = way - velocity * dt;
                let normal = vec3(normal);
                let target = if gap < 0.0 { gap - REGAINED * gap } else { 0.0 };
                let approach = target - (gap + relative.dot(&normal));
                let mut wall = Self {
                    particle: row as u32,
                    collider: number as u32,
                    normal,
                    velocity,
                    gap,
                    target,
                    stiffness: STIFFNESS / inv_m,
                    activity: Activity::Idle,
                    rub: 0.0,
                    pushed: 0.0,
                    slowed: Vec3::zeros(),
                };
                if approach > 0.0 {
                    // As if it carried itself alone.
                    wall.activity = Activity::Active;
                    wall.rub = wall.rub_of(collider.friction, approach / dt, &(way / dt), inv_m);
                }
                out.push(wall);
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

    /// Velocity (m/s) along the surface, relative to it.
    pub(crate) fn along(&self, velocity: &Vec3<f64>) -> Vec3<f64> {
        let relative = velocity - self.velocity;
        relative - self.normal * relative.dot(&self.normal)
    }

    /// Friction (kg) of a coefficient on a particle of mass 1 / `inv_m` that is pushed by so much (m/s) and ends with a velocity (m/s).
    fn rub_of(&self, friction: f64, pushed: f64, velocity: &Vec3<f64>, inv_m: f64) -> f64 {
        (friction * pushed.max(0.0) / self.along(velocity).norm().max(CREEP)).min(STUCK) / inv_m
    }

    /// Drops it where it pulls, adds it where it falls short, by shares of the thickness, hardens it where it is too deep before the round
    /// `last`, and takes over friction of a coefficient for a particle of mass 1 / `inv_m`; whether that calls for another solve.
    pub(crate) fn review(
        &mut self,
        (velocity, dt): (&Vec3<f64>, f64),
        thickness: f64,
        (friction, inv_m): (f64, f64),
        [round, last]: [u32; 2],
    ) -> bool {
        let before = self.rub;
        if self.activity.pushes() {
            self.rub = self.rub_of(friction, self.impulse(velocity, dt) * inv_m, velocity, inv_m);
        }
        let rubs_otherwise = round == 0 && (self.rub - before).abs() > RUB_CHANGE * (self.rub + before);
        let gap = self.gap_after(velocity, dt);
        let is_deep = self.activity.pushes() && gap < self.target - DEEP * thickness && round < last;
        if is_deep {
            self.stiffness *= HARDER;
        }
        let next = match self.activity {
            Activity::Active if gap > self.target + PULL * thickness => Activity::Dropped,
            Activity::Idle if gap < self.target - SHORT * thickness => Activity::Active,
            Activity::Dropped if gap < self.target - SHORT * thickness => Activity::Again,
            same => same,
        };
        if !next.pushes() {
            self.rub = 0.0;
        }
        std::mem::replace(&mut self.activity, next) != next || rubs_otherwise || is_deep
    }

    /// Keeps how fast (m/s) the solve that led to a velocity (m/s) pushed the particle, of mass 1 / `inv_m`, and by how much it was slowed.
    pub(crate) fn keep_push(&mut self, velocity: &Vec3<f64>, dt: f64, inv_m: f64) {
        (self.pushed, self.slowed) = if self.activity.pushes() {
            (self.impulse(velocity, dt) * inv_m, self.along(velocity) * (self.rub * inv_m))
        } else {
            (0.0, Vec3::zeros())
        };
    }

    /// Rubs the particle, of mass 1 / `inv_m`, that went from `start` (m) in `dt` (s) and ends at `x` (m) with a velocity `v` (m/s), by what
    /// Coulomb's bound leaves of what the solve pushed it with; the collider feels the impulses of the solve too. Whether that moved it.
    pub(crate) fn rub(
        &self,
        collider: &Collider,
        (start, inv_m, dt): (&Vec3<f64>, f64, f64),
        [x, v]: [&mut Vec3<f64>; 2],
        felt: &mut Felt,
    ) -> bool {
        // A pair that pulls, within what is allowed, has nothing to rub with.
        let left = self.pushed.max(0.0) - self.slowed.norm() / collider.friction;
        let push = if left > 0.0 { left } else { 0.0 };
        let slowing = push_and_rub(collider, &(*v - self.velocity), &self.normal, push) - self.normal * push;
        let given = self.normal * self.pushed - self.slowed + slowing;
        felt.take(collider, array3(&(given / inv_m)), array3(x), array3(&self.velocity));
        if slowing == Vec3::zeros() {
            return false;
        }
        *v += slowing;
        *x = start + *v * dt;
        true
    }
}

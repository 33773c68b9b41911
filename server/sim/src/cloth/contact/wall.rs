//! A particle and a collider as a pair: the solve knows colliders, else each step would press a pile together by its weight.
//!
//! Their rule after the solve stays; Coulomb's bound takes the impulse that the solve gave. What bounces is left to that rule.

use super::{
    friction::{Friction, Off, Seen},
    pair::Activity,
    rules::{ADDED, HARDER, SETTLING, SHORT, STIFFNESS},
    ways::{Ways, wide},
};
use crate::{
    cloth::layout::{Model, Pushed},
    collide::{Approach, Collider, Felt, push_and_rub},
    math::{Mat3, Padded, Real, Vec3, array3, vec3},
    sub_step::SubStep,
};

/// Speed (m/s) beyond which what a solve has of friction is cut off: what sticks.
const STUCK: f64 = 10.0;
/// Share of the thickness that a particle may be in a collider before its pair is made harder.
const DEEP: f64 = 0.1;
/// Cosine between two normals below which they are of different sides.
const SAME_SIDE: f64 = 0.5;

/// A particle near a collider in a sub-step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wall {
    pub(crate) particle: u32,
    pub(crate) collider: u32,
    /// Distance from where it touches (m), and the way out of the collider, at the start.
    gap: f64,
    out: Vec3<f64>,
    /// Out of the collider where they meet: a unit vector. The linear gap (m) there of what goes along with the surface, and the
    /// velocity of that (m/s).
    pub(crate) normal: Vec3<f64>,
    at_start: f64,
    pub(crate) velocity: Vec3<f64>,
    /// The gap that the solve aims at (m).
    pub(crate) target: f64,
    /// h² k (kg).
    pub(crate) stiffness: f64,
    pub(crate) activity: Activity,
    pub(super) friction: Friction,
    /// Whether it bounces, which the rule after the solve does.
    bounces: bool,
    /// How fast (m/s) the last solve pushed it, and along which normal.
    pub(crate) pushed: f64,
    pushed_along: Vec3<f64>,
    /// By how much (m/s) its friction slowed it.
    slowed: Vec3<f64>,
}

/// A particle in a sub-step: where it begins, its way (m), and its velocities (m/s) at both ends.
struct Goes {
    at: Vec3<f64>,
    way: Vec3<f64>,
    v: [Vec3<f64>; 2],
}

impl Goes {
    fn approach<'a>(&self, collider: &'a Collider, sub_step: SubStep) -> Approach<'a> {
        Approach { collider, x: [self.at, self.at + self.way], v: self.v, sub_step }
    }
}

impl Wall {
    /// All of a block that could meet within a sub-step, particle by particle.
    pub(crate) fn list<R: Real>(
        model: &Model<R>,
        block: usize,
        colliders: &[Collider],
        ([x, v], ways): ([&[Padded<R>]; 2], &Ways),
        sub_step: SubStep,
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
                let (distance, normal) = collider.distance(array3(&at), sub_step.start());
                let gap = distance - collider.margin;
                let velocity = vec3(collider.velocity_at(array3(&at), sub_step.start()));
                let room = (expected - velocity * sub_step.dt).norm() + ways.reach(row as u32);
                if gap > room {
                    continue;
                }
                let regained = (collider.recovery * sub_step.dt).min(-gap);
                let mut wall = Self {
                    particle: row as u32,
                    collider: number as u32,
                    gap,
                    out: vec3(normal),
                    normal: vec3(normal),
                    at_start: gap,
                    velocity,
                    target: if gap < 0.0 { gap + regained } else { 0.0 },
                    stiffness: STIFFNESS / inv_m,
                    activity: Activity::Idle,
                    friction: Friction::default(),
                    bounces: false,
                    pushed: 0.0,
                    pushed_along: Vec3::zeros(),
                    slowed: Vec3::zeros(),
                };
                wall.begin(collider, (at, wide(&v[row]), way), sub_step, inv_m);
                out.push(wall);
            }
        }
    }

    /// Begins to push a particle at `at` (m), of a velocity (m/s), of an inverse mass (1/kg), that would meet on its way (m) without it.
    fn begin(
        &mut self,
        collider: &Collider,
        (at, v, way): (Vec3<f64>, Vec3<f64>, Vec3<f64>),
        sub_step: SubStep,
        inv_m: f64,
    ) {
        let goes = Goes { at, way, v: [v, way / sub_step.dt] };
        self.bounces = goes.approach(collider, sub_step).bounces();
        if !self.meets(collider, &goes, sub_step) {
            return;
        }
        let velocity = way / sub_step.dt;
        let short = self.target - self.gap_after(&velocity, sub_step.dt);
        if short > 0.0 {
            self.activity = Activity::Active;
            // As if it carried itself alone.
            let bound = collider.friction * short / sub_step.dt / inv_m;
            if collider.friction > 0.0 {
                let along = self.along(&velocity);
                let came = self.along(&v).norm();
                self.friction = Friction::guess(Seen { bound, along, came, mass: 1.0 / inv_m });
            }
        }
    }

    /// Puts it where a particle meets the collider on its way; whether it does so.
    fn meets(&mut self, collider: &Collider, goes: &Goes, sub_step: SubStep) -> bool {
        if self.bounces {
            return false;
        }
        let end = goes.at + goes.way;
        let (distance, normal) = collider.distance(array3(&end), sub_step.end);
        let (gap, at_end) = (distance - collider.margin, vec3::<f64>(normal));
        if gap >= self.target {
            return false;
        }
        self.velocity = vec3(collider.velocity_at(array3(&end), sub_step.end));
        let way = goes.way - self.velocity * sub_step.dt;
        let is_same_side = |normal: &Vec3<f64>| normal.dot(&at_end) > SAME_SIDE;
        if is_same_side(&self.out) {
            (self.normal, self.at_start) = (at_end, gap - way.dot(&at_end));
            return true;
        }
        // It goes through an edge, or all of the solid: the side counts at which it came.
        let meeting = if self.gap < 0.0 { None } else { goes.approach(collider, sub_step).meets() };
        let (normal, share) = meeting.unwrap_or((self.out, 0.0));
        (self.normal, self.at_start) = if meeting.is_some() && is_same_side(&normal) {
            (at_end, gap - way.dot(&at_end))
        } else {
            (normal, self.gap.min(0.0) - share * way.dot(&normal))
        };
        true
    }

    /// The linear gap (m) after `dt` seconds with a velocity (m/s).
    pub(crate) fn gap_after(&self, velocity: &Vec3<f64>, dt: f64) -> f64 {
        self.at_start + dt * (velocity - self.velocity).dot(&self.normal)
    }

    /// Whether it is beyond what it aims at after `dt` seconds with a velocity (m/s).
    pub(crate) fn pulls(&self, velocity: &Vec3<f64>, dt: f64) -> bool {
        self.gap_after(velocity, dt) >= self.target
    }

    /// How much (m) of what was lost of the margin it gives back.
    pub(crate) fn regained(&self) -> f64 {
        (self.target - self.gap).max(0.0).min(-self.gap.min(0.0))
    }

    /// h times the force (N s) with which it pushes.
    pub(crate) fn impulse(&self, velocity: &Vec3<f64>, dt: f64) -> f64 {
        self.stiffness / dt * (self.target - self.gap_after(velocity, dt))
    }

    /// What it pushes with at a velocity (m/s), friction with it.
    pub(crate) fn pushed(&self, velocity: &Vec3<f64>, dt: f64) -> Pushed {
        let across = self.normal * self.normal.transpose();
        let way = self.friction.slides().map_or(Vec3::zeros(), |(way, _)| way);
        let beside = Mat3::identity() - across - way * way.transpose();
        Pushed {
            impulse: self.normal * self.impulse(velocity, dt) + self.friction.impulse(&self.along(velocity)),
            matrix: across * self.stiffness + beside * self.friction.rub(),
        }
    }

    /// Energy (J) of its push, on both sides of its target as the solve has it.
    pub(crate) fn energy(&self, velocity: &Vec3<f64>, dt: f64) -> f64 {
        let short = self.target - self.gap_after(velocity, dt);
        0.5 * self.stiffness / (dt * dt) * short * short
    }

    /// Velocity (m/s) along the surface, relative to it.
    pub(crate) fn along(&self, velocity: &Vec3<f64>) -> Vec3<f64> {
        let relative = velocity - self.velocity;
        relative - self.normal * relative.dot(&self.normal)
    }

    /// Looks at where the solve of a round leads: from where its particle begins (m), with which velocities (m/s) it begins and ends. Drops it where
    /// it pulls, adds it where it falls short, by shares of the thickness, puts it where it meets, hardens it where it is too deep before the round
    /// `last`, and takes over friction.
    pub(crate) fn review(
        &mut self,
        collider: &Collider,
        (at, v): (Vec3<f64>, [Vec3<f64>; 2]),
        sub_step: SubStep,
        (thickness, inv_m): (f64, f64),
        [round, last]: [u32; 2],
    ) -> (bool, Off) {
        let (dt, velocity) = (sub_step.dt, v[1]);
        let (gap, pushed) = (self.gap_after(&velocity, dt), self.activity.pushes());
        let push = if pushed { self.impulse(&velocity, dt).max(0.0) } else { 0.0 };
        let goes = Goes { at, way: velocity * dt, v };
        let meets = self.meets(collider, &goes, sub_step);
        let now = if meets { self.gap_after(&velocity, dt) } else { gap };
        if !pushed {
            let falls_short = meets && now < self.target - ADDED * thickness;
            let next = if falls_short { self.activity.added() } else { self.activity };
            let is_changed = next != self.activity;
            self.activity = next;
            return (is_changed, Off::default());
        }
        let off = if collider.friction > 0.0 && round < SETTLING {
            let bound = (collider.friction * push).min(STUCK / inv_m);
            let [came, along] = [&v[0], &v[1]].map(|v| self.along(v));
            let seen = Seen { bound, along, came: came.norm(), mass: 1.0 / inv_m };
            self.friction.look(seen, round)
        } else {
            Off::default()
        };
        if !meets {
            let next = self.activity.dropped((gap - self.target) / thickness, round);
            let is_changed = next != self.activity;
            if is_changed {
                (self.activity, self.friction) = (next, Friction::default());
            }
            return (is_changed, off);
        }
        let is_deep = now < self.target - DEEP * thickness && round < last;
        if is_deep {
            self.stiffness *= HARDER;
        }
        (is_deep || (now - gap).abs() > SHORT * thickness, off)
    }

    /// Keeps how fast (m/s) the solve that led to a velocity (m/s) pushed the particle, of mass 1 / `inv_m`, and by how much it was slowed.
    pub(crate) fn keep_push(&mut self, velocity: &Vec3<f64>, dt: f64, inv_m: f64) {
        self.pushed_along = self.normal;
        (self.pushed, self.slowed) = if self.activity.pushes() {
            (self.impulse(velocity, dt) * inv_m, self.friction.impulse(&self.along(velocity)) * -inv_m)
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
        let given = self.pushed_along * self.pushed - self.slowed + slowing;
        felt.take(collider, array3(&(given / inv_m)), array3(x), array3(&self.velocity));
        if slowing == Vec3::zeros() {
            return false;
        }
        *v += slowing;
        *x = start + *v * dt;
        true
    }
}

//! A particle and a collider: a stencil of one corner, whose other side goes the way of the surface. The solve knows colliders, else each
//! step would press a pile together by its weight.
//!
//! Their rule after the solve stays; Coulomb's bound takes the impulse that the solve gave. What bounces is left to that rule.

use super::{
    friction::{Friction, Off, Seen},
    hold::{Hold, Stencil},
    rules::{ADDED, HARDER, SETTLING, SHORT, STIFFNESS},
    ways::{Ways, wide},
};
use crate::{
    cloth::layout::Model,
    collide::{Approach, Collider, Felt, push_and_rub},
    math::{Padded, Real, Vec3, array3, vec3},
    sub_step::SubStep,
};

/// Speed (m/s) beyond which what a solve has of friction is cut off: what sticks.
const STUCK: f64 = 10.0;
/// Share of the thickness that a particle may be in a collider before its pair is made harder.
const DEEP: f64 = 0.1;
/// Cosine between two normals below which they are of different sides.
const SAME_SIDE: f64 = 0.5;

/// Bytes that particles of a cloth with a thickness (m) keep of so many colliders: hardly any is near more than one of them.
pub fn wall_bytes(particles: u64, thickness: f64, colliders: usize) -> u64 {
    if thickness > 0.0 && colliders > 0 { particles.saturating_mul(size_of::<Wall>() as u64) } else { 0 }
}

/// A particle near a collider in a sub-step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wall {
    collider: u32,
    /// The normal is that out of the collider where they meet.
    pub(super) stencil: Stencil,
    pub(super) hold: Hold,
    /// Out of the collider at the start: a unit vector.
    out: Vec3<f64>,
    /// Velocity (m/s) of the surface where they meet.
    pub(super) velocity: Vec3<f64>,
    /// Whether it bounces, which the rule after the solve does.
    bounces: bool,
    /// How fast (m/s) the last solve pushed it, and along which normal.
    pub(super) pushed: f64,
    pushed_along: Vec3<f64>,
    /// By how much (m/s) its friction slowed it.
    slowed: Vec3<f64>,
}

impl Wall {
    /// All of a block that could meet within a sub-step, particle by particle, in a sub-step as long as so many of the scene.
    pub(crate) fn list<R: Real>(
        model: &Model<R>,
        block: usize,
        colliders: &[Collider],
        ([x, v], ways): ([&[Padded<R>]; 2], &Ways),
        (sub_step, steps): (SubStep, f64),
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
                let normal = vec3(normal);
                let target = if gap < 0.0 { gap + regained } else { 0.0 };
                let mut wall = Self {
                    collider: number as u32,
                    stencil: Stencil::of_one(row as u32, normal),
                    hold: Hold::idle(gap, target, steps * steps * STIFFNESS / inv_m),
                    out: normal,
                    velocity,
                    bounces: false,
                    pushed: 0.0,
                    pushed_along: Vec3::zeros(),
                    slowed: Vec3::zeros(),
                };
                let v = [wide(&v[row]), way / sub_step.dt];
                wall.begin(&Approach { collider, x: [at, at + way], v, sub_step }, inv_m);
                out.push(wall);
            }
        }
    }

    /// Begins to push a particle, of an inverse mass (1/kg), that would meet on its way without it.
    fn begin(&mut self, comes: &Approach<'_>, inv_m: f64) {
        let Approach { collider, v: [v, velocity], sub_step, .. } = *comes;
        self.bounces = comes.bounces();
        if !self.meets(comes) {
            return;
        }
        let short = self.hold.short(self.across(&velocity, sub_step.dt));
        if short > 0.0 {
            self.hold.add();
            // As if it carried itself alone.
            let bound = collider.friction * short / sub_step.dt / inv_m;
            if collider.friction > 0.0 {
                let [came, along] = [&v, &velocity].map(|v| self.along(v));
                self.hold.rub = Friction::guess(Seen { bound, along, came: came.norm(), mass: 1.0 / inv_m });
            }
        }
    }

    /// Puts it where a particle meets the collider on its way; whether it does so.
    fn meets(&mut self, comes: &Approach<'_>) -> bool {
        let Approach { collider, x: [_, end], v: [_, velocity], sub_step } = *comes;
        let (distance, normal) = collider.distance(array3(&end), sub_step.end);
        let (gap, at_end) = (distance - collider.margin, vec3::<f64>(normal));
        if self.bounces || gap >= self.hold.target {
            return false;
        }
        self.velocity = vec3(collider.velocity_at(array3(&end), sub_step.end));
        let way = (velocity - self.velocity) * sub_step.dt;
        let is_same_side = |normal: &Vec3<f64>| normal.dot(&at_end) > SAME_SIDE;
        if is_same_side(&self.out) {
            (self.stencil.normal, self.hold.gap) = (at_end, gap - way.dot(&at_end));
            return true;
        }
        // It goes through an edge, or all of the solid: the side counts at which it came.
        let meeting = if self.hold.began < 0.0 { None } else { comes.meets() };
        let (normal, share) = meeting.unwrap_or((self.out, 0.0));
        (self.stencil.normal, self.hold.gap) = if meeting.is_some() && is_same_side(&normal) {
            (at_end, gap - way.dot(&at_end))
        } else {
            (normal, self.hold.began.min(0.0) - share * way.dot(&normal))
        };
        true
    }

    /// By how much (m) the particle gets farther from the surface in `dt` (s) with a velocity (m/s).
    fn across(&self, velocity: &Vec3<f64>, dt: f64) -> f64 {
        ((velocity - self.velocity) * dt).dot(&self.stencil.normal)
    }

    /// Velocity (m/s) along the surface, relative to it, at a velocity (m/s).
    fn along(&self, velocity: &Vec3<f64>) -> Vec3<f64> {
        self.stencil.along(&(velocity - self.velocity))
    }

    /// The one that meets the surface.
    pub(super) fn particle(&self) -> usize {
        self.stencil.corners[0] as usize
    }

    /// The particle and the number of the collider: walls of a block are listed in this order.
    pub(super) fn key(&self) -> [usize; 2] {
        [self.particle(), self.collider as usize]
    }

    /// Looks at where the solve of a round leads its particle. Drops it where it pulls, adds it where it falls short, by shares of the thickness, puts
    /// it where it meets, hardens it where it is too deep before the round `last`, and takes over friction.
    pub(crate) fn review(
        &mut self,
        comes: &Approach<'_>,
        (thickness, inv_m): (f64, f64),
        [round, last]: [u32; 2],
    ) -> (bool, Off) {
        let Approach { collider, v: [came, velocity], sub_step: SubStep { dt, .. }, .. } = *comes;
        let (across, pushed) = (self.across(&velocity, dt), self.hold.activity.pushes());
        let (gap, target) = (self.hold.gap_after(across), self.hold.target);
        let push = if pushed { self.hold.impulse(across, dt).max(0.0) } else { 0.0 };
        let meets = self.meets(comes);
        let now = if meets { self.hold.gap_after(self.across(&velocity, dt)) } else { gap };
        if !pushed {
            let falls_short = meets && now < target - ADDED * thickness;
            return (falls_short && self.hold.add(), Off::default());
        }
        let off = if collider.friction > 0.0 && round < SETTLING {
            let bound = (collider.friction * push).min(STUCK / inv_m);
            let [came, along] = [&came, &velocity].map(|v| self.along(v));
            let seen = Seen { bound, along, came: came.norm(), mass: 1.0 / inv_m };
            self.hold.rub.look(seen, round)
        } else {
            Off::default()
        };
        if !meets {
            return (self.hold.let_go((gap - target) / thickness, round), off);
        }
        let is_deep = now < target - DEEP * thickness && round < last;
        if is_deep {
            self.hold.stiffness *= HARDER;
        }
        (is_deep || (now - gap).abs() > SHORT * thickness, off)
    }

    /// Keeps how fast (m/s) the solve that led to a velocity (m/s) pushed the particle, of mass 1 / `inv_m`, and by how much it was slowed.
    pub(crate) fn keep_push(&mut self, velocity: &Vec3<f64>, dt: f64, inv_m: f64) {
        self.pushed_along = self.stencil.normal;
        (self.pushed, self.slowed) = if self.hold.activity.pushes() {
            let impulse = self.hold.impulse(self.across(velocity, dt), dt);
            (impulse * inv_m, self.hold.rub.impulse(&self.along(velocity)) * -inv_m)
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
        let normal = &self.stencil.normal;
        let slowing = push_and_rub(collider, &(*v - self.velocity), normal, push) - normal * push;
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

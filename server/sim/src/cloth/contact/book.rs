//! The energy of active pairs, by which a sub-step is judged.
//!
//! A pair that pulls has none: what comes from afar is not pressed before it is there. What moves by itself, a pin or a collider, gives its impulse
//! times its velocity, and what is given back of a thickness is given like the work of a wall that goes so far.

use super::{groups::Groups, pair::Pair, wall::Wall, ways::wide};
use crate::{
    cloth::layout::Model,
    math::{Padded, Real, Vec3},
};

/// Energies (J) of the pairs that were active in the last solve, with the linear gaps that it had.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PairEnergy {
    /// Where each group goes on as a whole, and pins and colliders have gone their way.
    pub(crate) start: f64,
    /// Where all went on at its velocity, with what friction takes there.
    pub(crate) at_velocity: f64,
    /// Where the solve led.
    pub(crate) end: f64,
    /// What pins and colliders give by pushing, beside carrying groups along, and what is given back of lost thickness.
    pub(crate) given: f64,
    /// What the motion of colliders gives of that, and of what carries groups along.
    pub(crate) of_colliders: f64,
    /// Whether any pushed.
    pub(crate) has_any: bool,
}

impl PairEnergy {
    /// That of pairs and walls in a sub-step of `dt` (s), from velocities (m/s) at its start and its end.
    pub(crate) fn of<'a, R: Real>(
        (model, groups): (&Model<R>, &Groups),
        pairs: &[Pair],
        walls: impl Iterator<Item = &'a Wall>,
        [before, after]: [&[Padded<R>]; 2],
        dt: f64,
    ) -> Self {
        let mut sum = Self::default();
        for pair in pairs.iter().filter(|pair| pair.activity.pushes()) {
            sum.add_pair((model, groups), pair, [before, after], dt);
        }
        for wall in walls.filter(|wall| wall.activity.pushes()) {
            let row = wall.particle as usize;
            let frame = groups.frames[groups.of_row(model, row)];
            let [went_on, went] = [before, after].map(|field| wide(&field[row]));
            let pressed = |v: &Vec3<f64>| if wall.pulls(v, dt) { 0.0 } else { wall.energy(v, dt) };
            sum.start += pressed(&frame);
            sum.at_velocity += wall.energy(&went_on, dt) + wall.friction.potential(&wall.along(&went_on));
            sum.end += pressed(&went);
            let push = wall.impulse(&went, dt);
            let impulse = wall.normal * push + wall.friction.impulse(&wall.along(&went));
            sum.given += impulse.dot(&(wall.velocity - frame)) + push.max(0.0) * wall.regained() / dt;
            sum.of_colliders += impulse.dot(&wall.velocity);
            sum.has_any = true;
        }
        sum
    }

    fn add_pair<R: Real>(
        &mut self,
        (model, groups): (&Model<R>, &Groups),
        pair: &Pair,
        [before, after]: [&[Padded<R>]; 2],
        dt: f64,
    ) {
        let corners = pair.candidate.corners;
        let frame = groups.frames[groups.of_row(model, corners[0] as usize)];
        let velocity = |field: &[Padded<R>]| corners.map(|corner| wide(&field[corner as usize]));
        let driven = corners.map(|corner| {
            let is_free = model.inv_m[corner as usize] > R::zero();
            if is_free { Vec3::zeros() } else { wide(&before[corner as usize]) - frame }
        });
        let [moved, went_on, went] = [driven, velocity(before), velocity(after)].map(|v| pair.relative(&v));
        let pressed = |way: &Vec3<f64>| if pair.pulls(way) { 0.0 } else { pair.energy(way, dt) };
        self.start += pressed(&(moved * dt));
        self.at_velocity += pair.energy(&(went_on * dt), dt) + pair.friction.potential(&pair.along(&went_on));
        self.end += pressed(&(went * dt));
        let push = pair.impulse(&(went * dt), dt);
        let impulse = pair.normal * push + pair.friction.impulse(&pair.along(&went));
        self.given += push.max(0.0) * pair.regained() / dt - impulse.dot(&moved);
        self.has_any = true;
    }
}

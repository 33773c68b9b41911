//! Pulls on particles of a cloth: forces that follow a point, renewed from the state at the start of each step of the world.
//!
//! Enters: what a call asks for, and the state of a cloth. Leaves: the force on each particle that is pulled. A pull is of a
//! particle, and ends by itself.

use std::{ops::Range, sync::Arc};

use serde::{Deserialize, Serialize};
use thiserror::Error;
use xxhash_rust::xxh3::Xxh3;

use crate::{
    cloth::{Model, State},
    math::{Real, array3},
};

/// What a call asks for: each of some particles is drawn to a point by a critically damped spring, a = w² (p - x) - 2 w v.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pull {
    /// Name of a cloth.
    pub body: String,
    /// Numbers of the particles within the body, from 0; all of them where there are none. Pins among all stay without.
    pub particles: Arc<[u32]>,
    /// Where each of them is drawn to (m); without any, their pulls end.
    pub points: Arc<[[f64; 3]]>,
    /// w (1/s).
    pub frequency: f64,
    /// The acceleration that the spring gives at most (m/s²).
    pub most: f64,
    /// How long it pulls (s), one step of the world at least.
    pub seconds: f64,
}

impl Pull {
    /// Largest product of frequency and time step: the force is held over a step, and explicit steps of one particle are
    /// stable below 0.83.
    pub const MOST_PHASE: f64 = 0.5;
    /// Times that a pull may last (s), both ends included.
    pub const SECONDS: [f64; 2] = [1e-9, 10.0];
    /// Largest accelerations (m/s²), both ends included.
    pub const MOST: [f64; 2] = [1e-9, 1e6];

    /// Frequencies that steps of `dt` (s) allow (1/s), both ends included.
    pub fn frequencies(dt: f64) -> [f64; 2] {
        [1e-9, Self::MOST_PHASE / dt]
    }

    /// Steps of `dt` (s) that it lasts, one at least.
    fn steps(&self, dt: f64) -> u64 {
        // A time of a whole number of steps stays one when the quotient is rounded.
        ((self.seconds / dt - 1e-9).ceil() as u64).max(1)
    }
}

/// A pull that was refused.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum PullError {
    #[error("'{body}' is snow, and follows no pull: a body of cloth is needed")]
    OnSnow { body: String },
    #[error(
        "{body}: {found} points for {needed} particles: one for each is needed, or none, which ends their pulls"
    )]
    Count { body: String, found: usize, needed: usize },
    #[error("{body}: there is no particle {particle} to pull: the body has {count}, from 0")]
    NotInBody { body: String, particle: u32, count: usize },
    #[error("{body}: particle {particle} is pinned, and follows no pull: a pin is moved")]
    OnPin { body: String, particle: u32 },
    #[error("the call pulls at {found} particles: allowed are {allowed}")]
    TooMany { found: usize, allowed: usize },
}

/// The pull on one particle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Held {
    /// In the user's numbering of the cloth.
    particle: u32,
    /// Where it is drawn to (m).
    point: [f64; 3],
    /// 1/s.
    frequency: f64,
    /// The acceleration at most (m/s²).
    most: f64,
    /// Steps of the world that it goes on for.
    steps_left: u64,
}

impl Held {
    /// The force (N) on a particle of a mass (kg) at a place (m) with a velocity (m/s).
    fn force(&self, mass: f64, x: [f64; 3], v: [f64; 3]) -> [f64; 3] {
        let (p, w) = (self.point, self.frequency);
        let a = [0, 1, 2].map(|c| w * w * (p[c] - x[c]) - 2.0 * w * v[c]);
        let size = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
        let share = if size > self.most { self.most / size } else { 1.0 };
        a.map(|c| mass * (share * c))
    }
}

/// The particle of the first pull that no cloth can have whose free particles are told.
pub(crate) fn unsound(pulls: &[Held], is_free: impl Fn(u32) -> bool) -> Option<u32> {
    let is_sound = |place: usize, held: &Held| {
        let Held { particle, point, frequency, most, steps_left } = held;
        let is_next = place == 0 || pulls[place - 1].particle < *particle;
        let is_above = |number: f64| number.is_finite() && number > 0.0;
        is_next
            && is_free(*particle)
            && point.iter().all(|c| c.is_finite())
            && is_above(*frequency)
            && is_above(*most)
            && *steps_left > 0
    };
    let mut all = pulls.iter().enumerate();
    all.find(|(place, held)| !is_sound(*place, held)).map(|(_, held)| held.particle)
}

/// The pulls on a cloth, one on a particle at most, in the order of the particles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pulls {
    held: Vec<Held>,
    /// The force (N) of each of them in this step.
    forces: Vec<[f64; 3]>,
}

impl Pulls {
    pub(crate) fn is_empty(&self) -> bool {
        self.held.is_empty()
    }

    /// All of them.
    pub(crate) fn held(&self) -> &[Held] {
        &self.held
    }

    /// Puts others in their place.
    pub(crate) fn put(&mut self, held: Vec<Held>) {
        self.forces.resize(held.len(), [0.0; 3]);
        self.held = held;
    }

    /// How many particles of a range are pulled.
    pub(crate) fn count_in(&self, particles: &Range<u32>) -> usize {
        let before = |end: u32| self.held.partition_point(|held| held.particle < end);
        before(particles.end) - before(particles.start)
    }

    /// Takes over what a call asks for, of the particles of a body, in steps of the world of `dt` (s); says whether a pull
    /// has begun or ended.
    pub(crate) fn set(
        &mut self,
        asked: &Pull,
        own: &Range<u32>,
        dt: f64,
        is_pinned: impl Fn(u32) -> bool,
    ) -> bool {
        let before = self.held.len();
        let listed = asked.particles.iter().map(|particle| own.start + particle);
        if asked.points.is_empty() {
            let mut ended: Vec<u32> = listed.collect();
            ended.sort_unstable();
            let ends = |particle: u32| {
                if ended.is_empty() {
                    own.contains(&particle)
                } else {
                    ended.binary_search(&particle).is_ok()
                }
            };
            self.held.retain(|held| !ends(held.particle));
        } else {
            let Pull { frequency, most, .. } = *asked;
            let steps_left = asked.steps(dt);
            let hold = |(particle, point): (u32, &[f64; 3])| Held {
                particle,
                point: *point,
                frequency,
                most,
                steps_left,
            };
            if asked.particles.is_empty() {
                let all = own.clone().zip(asked.points.iter());
                self.held.extend(all.filter(|(particle, _)| !is_pinned(*particle)).map(hold));
            } else {
                self.held.extend(listed.zip(asked.points.iter()).map(hold));
            }
            // Of each particle the last.
            self.held.reverse();
            self.held.sort_by_key(|held| held.particle);
            self.held.dedup_by_key(|held| held.particle);
        }
        self.forces.resize(self.held.len(), [0.0; 3]);
        self.held.len() != before
    }

    /// Makes the forces of a step from the state before it: on every rank all of them, from the ranks that compute the particles.
    pub(crate) fn renew<R: Real>(&mut self, model: &Model<R>, state: &State<R>) {
        let Self { held, forces } = self;
        for (held, force) in held.iter().zip(&mut *forces) {
            let place = model.place[held.particle as usize] as usize;
            *force = if model.share.has(place) {
                let [x, v] = [&state.x[place], &state.v[place]].map(|vector| array3(&vector.vector()));
                held.force(model.m[place].to_f64(), x, v)
            } else {
                [0.0; 3]
            };
        }
        if model.share.ranks().is_some() {
            complete(held, forces, model);
        }
    }

    /// Particles with the forces (N) that were made last, where they are not 0.
    pub(crate) fn now(&self) -> impl Iterator<Item = (u32, [f64; 3])> {
        let forces = self.held.iter().map(|held| held.particle).zip(self.forces.iter().copied());
        forces.filter(|(_, force)| *force != [0.0; 3])
    }

    /// Counts a step of the world that was taken; says whether a pull has ended with it.
    pub(crate) fn pass(&mut self) -> bool {
        let before = self.held.len();
        self.held.retain_mut(|held| {
            held.steps_left -= 1;
            held.steps_left > 0
        });
        self.forces.truncate(self.held.len());
        self.held.len() < before
    }

    /// Adds them to a hash; nothing where there are none.
    pub(crate) fn hash(&self, hasher: &mut Xxh3) {
        for Held { particle, point, frequency, most, steps_left } in &self.held {
            hasher.update(&particle.to_le_bytes());
            hasher.update(point.map(f64::to_le_bytes).as_flattened());
            hasher.update([*frequency, *most].map(f64::to_le_bytes).as_flattened());
            hasher.update(&steps_left.to_le_bytes());
        }
    }

    /// Memory that they take (bytes).
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.held) + size_of_val(&*self.forces)
    }
}

/// Completes the forces on all ranks. Ranks compute ranges of rows: the list that they complete is in the order of rows.
fn complete<R: Real>(held: &[Held], forces: &mut [[f64; 3]], model: &Model<R>) {
    let row = |held: &Held| model.place[held.particle as usize] as usize;
    let mut order: Vec<(usize, usize)> = held.iter().map(row).zip(0..).collect();
    order.sort_unstable();
    let mut list: Vec<[f64; 3]> = order.iter().map(|(_, at)| forces[*at]).collect();
    let before = |block: usize| order.partition_point(|(row, _)| *row < block * model.block_size);
    model.share.complete_numbers(&mut list, |rank| {
        let blocks = model.share.blocks_of(rank);
        before(blocks.start)..before(blocks.end)
    });
    for ((_, at), force) in order.iter().zip(list) {
        forces[*at] = force;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pull(particles: &[u32], points: &[[f64; 3]], seconds: f64) -> Pull {
        let body = "sheet".to_owned();
        Pull { body, particles: particles.into(), points: points.into(), frequency: 10.0, most: 5.0, seconds }
    }

    fn particles(pulls: &Pulls) -> Vec<u32> {
        pulls.held().iter().map(|held| held.particle).collect()
    }

    #[test]
    fn the_last_pull_on_a_particle_counts_and_others_go_on() {
        let mut pulls = Pulls::default();
        let (own, dt, pin) = (10..14, 0.1, |particle: u32| particle == 11);
        assert!(pulls.set(&pull(&[3, 0], &[[1.0; 3], [2.0; 3]], 0.3), &own, dt, pin));
        assert_eq!(particles(&pulls), [10, 13]);
        // Another point of one that is pulled begins nothing.
        assert!(!pulls.set(&pull(&[3, 3], &[[3.0; 3], [4.0; 3]], 0.1), &own, dt, pin));
        let told = pulls.held().iter().map(|held| (held.point[0], held.steps_left)).collect::<Vec<_>>();
        assert_eq!(told, [(2.0, 3), (4.0, 1)]);
        assert_eq!([pulls.count_in(&(0..10)), pulls.count_in(&(10..13)), pulls.count_in(&own)], [0, 1, 2]);
        assert!(pulls.pass());
        assert_eq!(particles(&pulls), [10]);
        assert!(!pulls.pass() && pulls.pass() && pulls.is_empty());
        // All but the pin, and none of another body.
        assert!(pulls.set(&pull(&[], &[[0.0; 3]; 4], 1.0), &own, dt, pin));
        assert_eq!(particles(&pulls), [10, 12, 13]);
        assert!(!pulls.set(&pull(&[], &[], 0.0), &(0..10), dt, pin));
        assert!(pulls.set(&pull(&[2], &[], 0.0), &own, dt, pin));
        assert_eq!(particles(&pulls), [10, 13]);
        assert!(pulls.set(&pull(&[], &[], 0.0), &own, dt, pin));
        assert!(pulls.is_empty() && pulls.bytes() == 0);
    }

    #[test]
    fn a_pull_is_a_damped_spring_up_to_its_bound() {
        let held = Held { particle: 0, point: [1.0, 0.0, 0.0], frequency: 2.0, most: 5.0, steps_left: 1 };
        assert_eq!(held.force(0.5, [0.0; 3], [0.0, 0.5, 0.0]), [2.0, -1.0, 0.0]);
        assert_eq!(held.force(0.5, [-9.0, 0.0, 0.0], [0.0; 3]), [2.5, 0.0, 0.0]);
    }
}

//! Contact of cloth: friction, restitution, and particles put back on the surface. A particle that would end
//! inside a collider loses its approach speed, is slowed by Coulomb friction, and is put on the surface.
//!
//! Reads and writes positions (m) and velocities (m/s) at the end of a step; colliders are met in
//! their order. The impulse of the normal bounds that of friction: `|dv_t| <= mu |dv_n|`.

use rayon::prelude::*;

use super::Collider;
use crate::math::{Padded, Real, Vec3, array3, vec3};

/// Where, when and for how long particles may have met colliders: the end of a step.
#[derive(Clone, Copy)]
pub(crate) struct Contacts<'a> {
    pub(crate) colliders: &'a [Collider],
    /// Time (s) at the end of the step.
    pub(crate) time: f64,
    /// Length (s) of the step.
    pub(crate) dt: f64,
    /// Particles per block.
    pub(crate) block_size: usize,
    /// The user's number of each particle.
    pub(crate) user: &'a [u32],
}

/// What met colliders in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Met {
    /// Particles that touched one.
    pub(crate) touched: u64,
    /// Particles that went through one between the start of the step and its end.
    pub(crate) passed: u64,
    /// The first of these in the user's numbering.
    pub(crate) first_passed: Option<u32>,
}

impl Met {
    /// What two disjoint sets of particles met.
    fn and(self, other: Self) -> Self {
        let first = self.first_passed.into_iter().chain(other.first_passed).min();
        Self {
            touched: self.touched + other.touched,
            passed: self.passed + other.passed,
            first_passed: first,
        }
    }

    /// What one particle met.
    fn of(user: u32, [touched, passed]: [bool; 2]) -> Self {
        let first_passed = passed.then_some(user);
        Self { touched: u64::from(touched), passed: u64::from(passed), first_passed }
    }
}

/// Resolves the contacts of all free particles (`inv_m` > 0); returns how many there were, and how many particles went
/// through a collider without one.
#[allow(clippy::disallowed_methods, reason = "whole numbers add to the same in any order")]
pub(crate) fn resolve<R: Real>(
    contacts: Contacts<'_>,
    inv_m: &[R],
    x: &mut [Padded<R>],
    v: &mut [Padded<R>],
) -> Met {
    if contacts.colliders.is_empty() {
        return Met::default();
    }

    let block_size = contacts.block_size;
    let constants = (contacts.user.par_chunks(block_size), inv_m.par_chunks(block_size));
    (constants, (x.par_chunks_mut(block_size), v.par_chunks_mut(block_size)))
        .into_par_iter()
        .map(|((user, inv_m), (x, v))| {
            let particles = user.iter().zip(inv_m).zip(x.iter_mut().zip(v));
            let free = particles.filter(|((_, inv_m), _)| **inv_m > R::zero());
            let met = free.map(|((user, _), (x, v))| Met::of(*user, meet(contacts, x, v)));
            met.fold(Met::default(), Met::and)
        })
        .reduce(Met::default, Met::and)
}

/// Resolves the contacts of one particle; says whether it had any, and whether it went through a collider.
fn meet<R: Real>(contacts: Contacts<'_>, to_x: &mut Padded<R>, to_v: &mut Padded<R>) -> [bool; 2] {
    let (mut x, mut v) = (to_x.vector(), to_v.vector());
    let [mut touched, mut passed] = [false; 2];
    let start = x.map(R::to_f64) - v.map(R::to_f64) * contacts.dt;
    for collider in contacts.colliders {
        let (distance, normal) = collider.distance(array3(&x), contacts.time);
        if distance >= collider.margin {
            passed |= has_passed(collider, contacts, [start, x.map(R::to_f64)], (distance, normal));
            continue;
        }

        touched = true;

        let change = velocity_change(collider, &v.map(R::to_f64), &vec3(normal));

        // The step moved the particle with the velocity that it no longer has.
        let mut position = x.map(R::to_f64) + change * contacts.dt;
        let (distance, normal) = collider.distance(array3(&position), contacts.time);
        if distance < collider.margin {
            position += vec3::<f64>(normal) * (collider.margin - distance);
        }

        x = position.map(R::of);
        v = (v.map(R::to_f64) + change).map(R::of);
    }

    if touched {
        (*to_x, *to_v) = (Padded::new(&x), Padded::new(&v));
    }
    [touched, passed]
}

/// Steps of a search along the way of a particle, at most.
const SEARCH_STEPS: u32 = 64;
/// Distance from a surface at which a way has come to it, over the length of the way.
const REACHED: f64 = 1e-3;

/// Whether a particle went through a collider from `start` to `end`, which lies outside: it came to the surface on its
/// way, and at the start the nearest of it looked the other way than at the end.
fn has_passed(
    collider: &Collider,
    contacts: Contacts<'_>,
    [start, end]: [Vec3<f64>; 2],
    (distance, normal): (f64, [f64; 3]),
) -> bool {
    // As the collider sees it, which stands where it is at the end.
    let way = end - start - vec3::<f64>(collider.velocity) * contacts.dt;
    let length = way.norm();
    // No point of the surface is nearer than `distance`.
    if distance >= length || !length.is_finite() {
        return false;
    }

    let at = |share: f64| collider.distance(array3(&(end - way * share)), contacts.time);
    let (start, came_from) = at(1.0);
    if start < 0.0 || vec3::<f64>(came_from).dot(&vec3(normal)) >= 0.0 {
        return false;
    }

    // Back from the end, by as much as is free of the surface in every direction.
    let mut gone = distance / length;
    for _ in 0..SEARCH_STEPS {
        if gone >= 1.0 {
            return false;
        }
        let distance = at(gone).0;
        if distance <= REACHED * length {
            return true;
        }
        gone += distance / length;
    }
    false
}

/// What a collider adds to the velocity of a particle that touches it.
fn velocity_change(collider: &Collider, v: &Vec3<f64>, normal: &Vec3<f64>) -> Vec3<f64> {
    let relative = v - vec3::<f64>(collider.velocity);
    let approach = relative.dot(normal);
    if approach >= 0.0 {
        return Vec3::zeros();
    }

    let push = -(1.0 + collider.restitution) * approach;
    let sliding = relative - normal * approach;
    let speed = sliding.norm();
    let slowed = if speed > 0.0 { (collider.friction * push / speed).min(1.0) } else { 0.0 };
    normal * push - sliding * slowed
}

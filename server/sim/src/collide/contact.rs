//! Contact: a particle that would end inside a collider loses its approach speed, is slowed by
//! Coulomb friction, and is put on the surface.
//!
//! Reads and writes positions (m) and velocities (m/s) at the end of a step; colliders are met in
//! their order. The impulse of the normal bounds that of friction: `|dv_t| <= mu |dv_n|`.

use rayon::prelude::*;

use super::Collider;
use crate::math::{Real, Vec3, array3, vec3};

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
}

/// Resolves the contacts of all free particles (`inv_m` > 0); returns how many touched a collider.
#[allow(clippy::disallowed_methods, reason = "whole numbers add to the same in any order")]
pub(crate) fn resolve<R: Real>(
    contacts: Contacts<'_>,
    inv_m: &[R],
    x: &mut [Vec3<R>],
    v: &mut [Vec3<R>],
) -> u64 {
    if contacts.colliders.is_empty() {
        return 0;
    }

    let block_size = contacts.block_size;
    (inv_m.par_chunks(block_size), x.par_chunks_mut(block_size), v.par_chunks_mut(block_size))
        .into_par_iter()
        .map(|(inv_m, x, v)| {
            let free = inv_m.iter().zip(x.iter_mut().zip(v)).filter(|(inv_m, _)| **inv_m > R::zero());
            free.map(|(_, (x, v))| touch(contacts, x, v)).filter(|touched| *touched).count() as u64
        })
        .reduce(|| 0, |a, b| a + b)
}

/// Resolves the contacts of one particle; says whether it had any.
fn touch<R: Real>(contacts: Contacts<'_>, x: &mut Vec3<R>, v: &mut Vec3<R>) -> bool {
    let mut touched = false;
    for collider in contacts.colliders {
        let (distance, normal) = collider.distance(array3(x), contacts.time);
        if distance >= collider.margin {
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

        *x = position.map(R::of);
        *v = (v.map(R::to_f64) + change).map(R::of);
    }

    touched
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

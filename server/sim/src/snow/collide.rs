//! Collisions of particles: the second stage, after that of the grid (Stomakhin et al. 2013, step 9).
//!
//! Reads velocities that a group brought from the grid; writes them after contact.

use super::{grid::SIDE, step::StepContext, update::Arrival};
use crate::{collide::velocity_after, math::Real};

/// Whether a particle of a block may meet a collider.
pub(super) fn particles_near(context: &StepContext<'_>, block: [i32; 3], h: f64) -> bool {
    let center = block.map(|c| (f64::from(c * SIDE as i32) + 2.75) * h);
    // Half a block, the offset of a first node, and a cell on the way.
    let radius = 3.75 * 3.0_f64.sqrt() * h;
    context.colliders.iter().any(|c| c.distance(center, context.time).0 <= radius + c.margin)
}

/// Lets velocities of particles at `positions` answer to colliders where they would enter one (step 9).
pub(super) fn collide<R: Real>(context: &StepContext<'_>, positions: &[[R; 4]], arrival: &mut Arrival<R>) {
    for lane in 0..positions.len() {
        for collider in context.colliders {
            let at: [f64; 3] =
                [0, 1, 2].map(|k| positions[lane][k].to_f64() + context.dt * arrival.drift[k][lane].to_f64());
            let (distance, normal) = collider.distance(at, context.time);
            if distance >= collider.margin {
                continue;
            }
            let before = [0, 1, 2].map(|k| arrival.v[k][lane].to_f64());
            let after: [f64; 3] = velocity_after(collider, before, normal);
            for k in 0..3 {
                arrival.v[k][lane] = R::of(after[k]);
                let drift = arrival.drift[k][lane].to_f64() + (after[k] - before[k]);
                arrival.drift[k][lane] = R::of(drift);
            }
        }
    }
}

//! Collisions of particles: the second stage, after that of the grid (Stomakhin et al. 2013, step 9).
//!
//! Reads velocities that a group brought from the grid; writes them after contact.

use super::{context::StepContext, grid_to_particles::Arrival};
use crate::{
    collide::velocity_after,
    math::{Real, array::dot},
    snow::{
        grid::{SIDE, block_of},
        particles::Motion,
    },
};

/// Says which groups of particles may meet a collider, block after block.
pub(crate) struct Nearness<'a> {
    context: &'a StepContext<'a>,
    cell: f64,
    /// The first block that was not looked at, and whether the one before it is near.
    next: usize,
    last: bool,
}

impl<'a> Nearness<'a> {
    /// From a block on, on cells of side `cell` (m).
    pub(crate) fn new(context: &'a StepContext<'a>, cell: f64, block: usize) -> Self {
        Self { context, cell, next: block, last: false }
    }

    /// Whether a block after those of the last call is near, up to `block`, or the last of those.
    pub(crate) fn reaches(&mut self, blocks: &[u64], block: usize) -> bool {
        let mut any = self.last;
        for key in &blocks[self.next..=block] {
            self.last = particles_near(self.context, block_of(*key), self.cell);
            any |= self.last;
        }
        self.next = block + 1;
        any
    }
}

/// Whether a particle of a block may meet a collider.
fn particles_near(context: &StepContext<'_>, block: [i32; 3], h: f64) -> bool {
    let center = block.map(|c| (f64::from(c * SIDE as i32) + 2.75) * h);
    // Half a block, the offset of a first node, and a cell on the way.
    let radius = 3.75 * 3.0_f64.sqrt() * h;
    context.colliders.iter().any(|c| c.distance(center, context.time).0 <= radius + c.margin)
}

/// Lets velocities of the first `count` particles of a group answer to colliders where they would
/// enter one (step 9); returns the kinetic energy (J) that those gained which gained any.
pub(crate) fn collide<R: Real>(
    context: &StepContext<'_>,
    motion: &Motion<R>,
    count: usize,
    arrival: &mut Arrival<R>,
) -> f64 {
    let mut given = 0.0;
    for lane in 0..count {
        let (x, m) = motion.of_one(lane);

        for collider in context.colliders {
            let at: [f64; 3] =
                [0, 1, 2].map(|k| x[k].to_f64() + context.dt * arrival.drift[k][lane].to_f64());
            let (distance, normal) = collider.distance(at, context.time);
            if distance >= collider.margin {
                continue;
            }
            let before = [0, 1, 2].map(|k| arrival.v[k][lane].to_f64());
            let after: [f64; 3] = velocity_after(collider, before, normal);
            given += 0.5 * m.to_f64() * (dot(after, after) - dot(before, before)).max(0.0);
            for k in 0..3 {
                arrival.v[k][lane] = R::of(after[k]);
                let drift = arrival.drift[k][lane].to_f64() + (after[k] - before[k]);
                arrival.drift[k][lane] = R::of(drift);
            }
        }
    }
    given
}

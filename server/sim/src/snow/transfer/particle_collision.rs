//! Collisions of particles: the second stage, after that of the grid (Stomakhin et al. 2013, step 9).
//!
//! Reads velocities that a group brought from the grid; writes them after contact, and counts what went through a collider.

use super::{context::StepContext, grid_to_particles::Arrival};
use crate::{
    collide::{has_passed, velocity_after},
    math::{
        Real,
        array::{dot, length, minus},
    },
    report::Notices,
    snow::{
        grid::{SIDE, block_of},
        particles::Motion,
    },
};

/// Share of a cell, or of a collider that is thinner, by which snow may be inside and still count as in front: what slides
/// over a round solid goes in by less.
const WITHIN: f64 = 0.1;

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

/// What colliders did to the particles of a chunk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Collided {
    /// Side of a cell (m).
    cell: f64,
    /// Kinetic energy (J) that those gained which gained any.
    pub(crate) given: f64,
    /// Particles that went through a collider, or into it.
    pub(crate) notices: Notices,
}

impl Collided {
    /// Nothing so far, on cells of side `cell` (m).
    pub(crate) fn new(cell: f64) -> Self {
        Self { cell, given: 0.0, notices: Notices::default() }
    }

    /// Lets velocities of the particles of a group, which have these numbers, answer to colliders where they would
    /// enter one (step 9), and counts those that go through one all the same.
    pub(crate) fn collide<R: Real>(
        &mut self,
        context: &StepContext<'_>,
        motion: &Motion<R>,
        ids: &[u32],
        arrival: &mut Arrival<R>,
    ) {
        let speeds = context.colliders.iter().map(|collider| length(collider.velocity));
        let shift = context.dt * speeds.fold(0.0, f64::max);
        // Added group by group.
        let given = std::mem::take(&mut self.given);
        for (lane, id) in ids.iter().enumerate() {
            let (x, m) = motion.of_one(lane);
            let x = x.map(Real::to_f64);
            let nearest = self.answer(context, (x, m.to_f64()), lane, arrival);

            let end = position(context, x, lane, arrival);
            if nearest < length(minus(end, x)) + shift && self.has_passed::<R>(context, [x, end]) {
                let first_passed = Some(u64::from(*id));
                self.notices =
                    self.notices.and(Notices { passed_count: 1, first_passed, ..Notices::default() });
            }
        }
        self.given += given;
    }

    /// Lets the velocity of one particle of a place (m) and a mass (kg) answer. Gives the distance (m) of the nearest
    /// surface from where it goes, or less where the particle was touched.
    fn answer<R: Real>(
        &mut self,
        context: &StepContext<'_>,
        (x, m): ([f64; 3], f64),
        lane: usize,
        arrival: &mut Arrival<R>,
    ) -> f64 {
        let mut nearest = f64::INFINITY;
        for collider in context.colliders {
            let at = position(context, x, lane, arrival);
            let (distance, normal) = collider.distance(at, context.time);
            if distance >= collider.margin {
                nearest = nearest.min(distance);
                continue;
            }
            // Those before it were measured from another place.
            nearest = f64::NEG_INFINITY;

            let before = [0, 1, 2].map(|k| arrival.v[k][lane].to_f64());
            let after: [f64; 3] = velocity_after(collider, before, normal);
            self.given += 0.5 * m * (dot(after, after) - dot(before, before)).max(0.0);
            for k in 0..3 {
                arrival.v[k][lane] = R::of(after[k]);
                let drift = arrival.drift[k][lane].to_f64() + (after[k] - before[k]);
                arrival.drift[k][lane] = R::of(drift);
            }
        }
        nearest
    }

    /// Whether a particle goes through a collider, or into it, on its way from one place (m) to another.
    fn has_passed<R: Real>(&self, context: &StepContext<'_>, way: [[f64; 3]; 2]) -> bool {
        let rounding = 4.0 * R::ROUNDING * way[1].into_iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        context.colliders.iter().any(|collider| {
            let spare = rounding + WITHIN * self.cell.min(collider.shape.thickness());
            has_passed(collider, context.time, context.dt, way, spare)
        })
    }
}

/// Where a particle of a group goes (m) from `x` (m).
fn position<R: Real>(context: &StepContext<'_>, x: [f64; 3], lane: usize, arrival: &Arrival<R>) -> [f64; 3] {
    [0, 1, 2].map(|k| x[k] + context.dt * arrival.drift[k][lane].to_f64())
}

//! Collisions of particles: the second stage, after that of the grid (Stomakhin et al. 2013, step 9).
//!
//! Reads velocities that a group brought from the grid; writes them after contact, and counts what went through a collider.

use super::{context::StepContext, grid_to_particles::Arrival};
use crate::{
    collide::{ChunkLoads, Collider, Felt, has_passed, velocity_after},
    math::{
        LANES, Real,
        array::{length, minus},
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

/// Says which particles may meet a collider, block after block.
pub(crate) struct Nearness<'a> {
    context: &'a StepContext<'a>,
    /// Side of a cell (m).
    cell: f64,
    /// Keys of blocks, and where each begins in the order.
    blocks: &'a [u64],
    starts: &'a [u32],
    /// The block that was asked for last, and whether it is near.
    block: usize,
    is_near: Option<bool>,
}

impl<'a> Nearness<'a> {
    /// From a block on, on cells of side `cell` (m).
    pub(crate) fn new(
        context: &'a StepContext<'a>,
        cell: f64,
        (blocks, starts): (&'a [u64], &'a [u32]),
        block: usize,
    ) -> Self {
        Self { context, cell, blocks, starts, block, is_near: None }
    }

    /// Which of the particles at some positions of the order are in a block that is near; positions ascend from call to call.
    pub(crate) fn lanes(&mut self, first: usize, count: usize) -> [bool; LANES] {
        let Self { context, cell, blocks, starts, block, is_near } = self;
        let mut lanes = [false; LANES];
        if context.colliders.is_empty() {
            return lanes;
        }
        if let Some(is_near) = *is_near
            && first + count <= starts[*block + 1] as usize
        {
            return [is_near; LANES];
        }
        for (position, lane) in (first..first + count).zip(&mut lanes) {
            while starts[*block + 1] as usize <= position {
                (*block, *is_near) = (*block + 1, None);
            }
            let key = blocks[*block];
            *lane = *is_near.get_or_insert_with(|| particles_near(context, block_of(key), *cell));
        }
        lanes
    }
}

/// Whether a particle of a block may meet a collider.
fn particles_near(context: &StepContext<'_>, block: [i32; 3], h: f64) -> bool {
    let center = block.map(|c| (f64::from(c * SIDE as i32) + 2.75) * h);
    // Half a block, the offset of a first node, and a cell on the way.
    let radius = 3.75 * 3.0_f64.sqrt() * h;
    context.colliders.iter().any(|c| c.distance(center, context.sub_step.end).0 <= radius + c.margin)
}

/// What colliders did to the particles of a chunk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Collided {
    /// Side of a cell (m).
    cell: f64,
    /// Particles that went through a collider, or into it.
    pub(crate) notices: Notices,
}

impl Collided {
    /// Nothing so far, on cells of side `cell` (m).
    pub(crate) fn new(cell: f64) -> Self {
        Self { cell, notices: Notices::default() }
    }

    /// Lets velocities of those particles of a group that are near, all of which have these numbers, answer to colliders where
    /// they would enter one (step 9), and counts those that go through one all the same. What colliders feel of it goes to the
    /// loads of their blocks, from the position of the first in the order on.
    pub(crate) fn collide<R: Real>(
        &mut self,
        context: &StepContext<'_>,
        motion: &Motion<R>,
        (ids, near): (&[u32], &[bool; LANES]),
        arrival: &mut Arrival<R>,
        (loads, first): (&mut ChunkLoads<'_>, usize),
    ) {
        let speed = |collider: &Collider, at| length(collider.velocity_at(at, context.sub_step.end));
        let shift_at = |at: [f64; 3]| {
            context.sub_step.dt
                * context.colliders.iter().map(|collider| speed(collider, at)).fold(0.0, f64::max)
        };
        let turns = context.colliders.iter().any(|collider| collider.way.is_some());
        let shift = shift_at([0.0; 3]);
        for (lane, id) in ids.iter().enumerate().filter(|(lane, _)| near[*lane]) {
            let (x, m) = motion.of_one(lane);
            let x = [x[0].to_f64(), x[1].to_f64(), x[2].to_f64()];
            let nearest = Self::answer(context, (x, m.to_f64()), lane, arrival, loads.at(first + lane));

            let end = position(context, x, lane, arrival);
            let shift = if turns { shift_at(end) } else { shift };
            if nearest < length(minus(end, x)) + shift && self.has_passed::<R>(context, [x, end]) {
                let first_passed = Some(u64::from(*id));
                self.notices =
                    self.notices.and(Notices { passed_count: 1, first_passed, ..Notices::default() });
            }
        }
    }

    /// Lets the velocity of one particle of a place (m) and a mass (kg) answer, which each collider feels. Gives the distance (m)
    /// of the nearest surface from where it goes, or less where the particle was touched.
    fn answer<R: Real>(
        context: &StepContext<'_>,
        (x, m): ([f64; 3], f64),
        lane: usize,
        arrival: &mut Arrival<R>,
        felt: &mut [Felt],
    ) -> f64 {
        let mut nearest = f64::INFINITY;
        for (collider, felt) in context.colliders.iter().zip(felt) {
            let at = position(context, x, lane, arrival);
            let (distance, normal) = collider.distance(at, context.sub_step.end);
            if distance >= collider.margin {
                nearest = nearest.min(distance);
                continue;
            }
            // Those before it were measured from another place.
            nearest = f64::NEG_INFINITY;

            let before = [0, 1, 2].map(|k| arrival.v[k][lane].to_f64());
            let moving = collider.velocity_at(at, context.sub_step.end);
            let after: [f64; 3] = velocity_after(collider, moving, before, normal);
            for k in 0..3 {
                arrival.v[k][lane] = R::of(after[k]);
                let drift = arrival.drift[k][lane].to_f64() + (after[k] - before[k]);
                arrival.drift[k][lane] = R::of(drift);
            }
            let taken = [0, 1, 2].map(|k| m * (arrival.v[k][lane].to_f64() - before[k]));
            felt.take(collider, taken, at, moving);
        }
        nearest
    }

    /// Whether a particle goes through a collider, or into it, on its way from one place (m) to another.
    fn has_passed<R: Real>(&self, context: &StepContext<'_>, way: [[f64; 3]; 2]) -> bool {
        let rounding = 4.0 * R::ROUNDING * way[1].into_iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        context.colliders.iter().any(|collider| {
            let spare = rounding + WITHIN * self.cell.min(collider.shape.thickness());
            has_passed(collider.into(), context.sub_step, way, spare)
        })
    }
}

/// Where a particle of a group goes (m) from `x` (m).
#[inline(always)]
fn position<R: Real>(context: &StepContext<'_>, x: [f64; 3], lane: usize, arrival: &Arrival<R>) -> [f64; 3] {
    let along = |k: usize| x[k] + context.sub_step.dt * arrival.drift[k][lane].to_f64();
    [along(0), along(1), along(2)]
}

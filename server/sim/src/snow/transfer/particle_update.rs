//! Particles after the grid: deformation, collisions, positions, stress; and where they go.
//!
//! Reads what the grid gives; writes the particles, their extremes and the cell that each is in
//! (Stomakhin et al. 2013, steps 7 to 10). Deformation goes by what a group brings from the grid, so
//! that a particle is read and written once in a step.

use std::marker::PhantomData;

use super::{
    context::StepContext,
    grid_to_particles::{Arrival, GridToGroup, InterpolationScale},
    particle_collision::{Collided, Nearness},
    scheme::{Scheme, with_scheme},
    stencil::{Stencil, StencilNodes, TILE},
    tally::{ChunkDiagnostics, Tally},
    weights::first_node,
};
use crate::{
    collide::{BlockLoads, ChunkLoads},
    math::{Columns, LANES, Pack, Real, WithSimd, dispatch},
    parallel::{Own, between_mut, per_block_mut, several_between_mut},
    snow::{
        attached::Attached,
        bound::extremes,
        grid::{Grid, Sorter, codes},
        law::{Deformed, MaterialConstants, Moduli, deform, predict, undeformed},
        model::SnowModel,
        particles::{Constants, Group, Lanes, Motion, NewLanes, Particles, SharedParticles},
    },
};

/// Takes velocities from the grid, and with them moves and deforms all particles; notes where they
/// go, what each chunk tells, and the energy (J) that hardening, and colliders that move, gave those of each block.
pub(crate) fn update_particles<R: Real>(
    model: &SnowModel<R>,
    context: &StepContext<'_>,
    particles: &mut Particles<R>,
    sorter: &mut Sorter,
    grid: &Grid<R>,
    told: Told<'_>,
) {
    with_scheme!(model.settings, (S, N) => {
        update_chunks::<R, S, N>(model, context, particles, sorter, grid, told);
    });
}

/// What chunks tell, the energy (J) that hardening gave the particles of each block, and what they gave to colliders.
pub(crate) type Told<'a> = (&'a mut Vec<ChunkDiagnostics>, &'a mut Vec<f64>, &'a mut BlockLoads);

fn update_chunks<R: Real, S: Scheme, const N: usize>(
    model: &SnowModel<R>,
    context: &StepContext<'_>,
    particles: &mut Particles<R>,
    sorter: &mut Sorter,
    grid: &Grid<R>,
    (diagnostics, given, loads): Told<'_>,
) {
    let SnowModel { settings, materials, attached, .. } = model;
    let h = settings.cell;
    let scale = InterpolationScale::of(settings, settings.transfer.flip_share(context.sub_step.dt));
    let particles = particles.share();
    let (sorted, migration) = sorter.migrate();
    diagnostics.resize(sorted.chunks.count(), ChunkDiagnostics::default());
    given.resize(grid.blocks.len(), 0.0);

    let (scratch, chunks) = (|| [[R::zero(); TILE]; 2], Own::whole(diagnostics.len(), 1));
    let (starts, colliders) = (sorted.chunks.starts(), context.colliders.len());
    let loads = several_between_mut(loads.sized_for(grid.blocks.len(), colliders), starts, colliders);
    let fields = (per_block_mut(diagnostics), between_mut(given, starts), loads);
    chunks.each_with(scratch, fields, |tiles, chunk, (diagnostics, given, loads)| {
        let (block, first, list) = sorted.chunk(chunk);
        let mut given = Given::new(given, &sorted.starts[block..]);
        let mut loads = ChunkLoads::new(loads, colliders, &sorted.starts[block..]);
        let mut stencil = Stencil::new(sorted, StencilNodes::of(grid, tiles), block);
        let mut contact = Nearness::new(context, h, (&grid.blocks, sorted.starts), block);
        let (mut tally, mut arrivals) = (Tally::new(), [Arrival::new(); TOGETHER]);
        let mut collided = Collided::new(h);
        let (mut motions, mut codes) = ([Motion::new(); TOGETHER], [[0; LANES]; TOGETHER]);
        let mut hardened = [[R::zero(); LANES]; TOGETHER];

        for start in (0..list.len()).step_by(LANES * TOGETHER) {
            let groups: [Group; TOGETHER] = std::array::from_fn(|k| Group::from(list, start + k * LANES));
            particles.prefetch(list, start, LANES * TOGETHER);

            // 8 and 9. Velocities of particles, and their collisions.
            for (k, group) in groups.iter().enumerate().filter(|(_, group)| group.count > 0) {
                particles.read_motion(group, &mut motions[k]);
                dispatch(GridToGroup::<R, S, N> {
                    scale,
                    motion: &motions[k],
                    start: first + start + k * LANES,
                    count: group.count,
                    stencil: &mut stencil,
                    arrival: &mut arrivals[k],
                    scheme: PhantomData,
                });
                let near = contact.lanes(first + start + k * LANES, group.count);
                if near.contains(&true) {
                    let ids = group.at.map(|at| particles.id[at as usize]);
                    let particles = (&ids[..group.count], &near);
                    let loads = (&mut loads, first + start + k * LANES);
                    collided.collide(context, &motions[k], particles, &mut arrivals[k], loads);
                }
            }

            // 7 and 10. Deformation gradients and stresses; positions.
            dispatch(Update {
                groups: &groups,
                motions: &motions,
                arrivals: &arrivals,
                particles: &particles,
                materials,
                attached,
                dt: R::of(context.sub_step.dt),
                inverse_cell: R::of(1.0 / h),
                ballistic_below: R::of(settings.ballistic_below),
                deformation: Deformation::Step,
                width: N,
                tally: &mut tally,
                periodic: settings.periodic,
                codes: &mut codes,
                given: &mut hardened,
            });
            for (k, group) in groups.iter().enumerate() {
                let position = first + start + k * LANES;
                migration.note(position, &codes[k][..group.count]);
                given.add(position, &hardened[k][..group.count]);
            }
        }
        *diagnostics = tally.finish();
        diagnostics.notices = collided.notices;
    });
}

/// The energy (J) that the particles of each block of a chunk were given, added one by one in their order.
struct Given<'a> {
    blocks: &'a mut [f64],
    /// Where each block begins in the order.
    starts: &'a [u32],
    /// The block that was added to last.
    block: usize,
}

impl<'a> Given<'a> {
    fn new(blocks: &'a mut [f64], starts: &'a [u32]) -> Self {
        blocks.fill(0.0);
        Self { blocks, starts, block: 0 }
    }

    /// Adds what hardening gave particles from a position of the order on; positions ascend from call to call.
    fn add<R: Real>(&mut self, position: usize, hardened: &[R]) {
        for (lane, hardened) in hardened.iter().enumerate() {
            let given = hardened.to_f64();
            if given != 0.0 {
                while self.starts[self.block + 1] as usize <= position + lane {
                    self.block += 1;
                }
                self.blocks[self.block] += given;
            }
        }
    }
}

/// What to do with the deformation.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Deformation {
    /// Predict, return, renew the stress.
    Step,
    /// Leave F_E and J_P as they are; renew the stress.
    Refresh,
}

/// Groups that are worked on together: one waits for square roots while the other goes on.
pub(crate) const TOGETHER: usize = 2;

/// The update of two groups; the second may be empty.
pub(crate) struct Update<'a, 'b, R> {
    pub(crate) groups: &'a [Group; TOGETHER],
    /// The groups before the step.
    pub(crate) motions: &'a [Motion<R>; TOGETHER],
    pub(crate) arrivals: &'a [Arrival<R>; TOGETHER],
    pub(crate) particles: &'a SharedParticles<'b, R>,
    pub(crate) materials: &'a [MaterialConstants<R>],
    pub(crate) attached: &'a Attached<R>,
    /// Time step (s); 1 / h (1/m); density on the grid over own, below which a particle is ballistic.
    pub(crate) dt: R,
    pub(crate) inverse_cell: R,
    pub(crate) ballistic_below: R,
    pub(crate) deformation: Deformation,
    /// Nodes per axis of the kernel.
    pub(crate) width: usize,
    pub(crate) tally: &'a mut Tally<R>,
    /// Blocks per period along each axis; 0: not periodic.
    pub(crate) periodic: [u32; 3],
    /// Where the particles went, see [`codes`].
    pub(crate) codes: &'a mut [[u16; LANES]; TOGETHER],
    /// Energy (J) that hardening gave each of them.
    pub(crate) given: &'a mut [Lanes<R>; TOGETHER],
}

#[inline(always)]
fn load3<P: Pack>(lanes: &[Lanes<P::Number>; 3]) -> [P; 3] {
    [P::load(&lanes[0]), P::load(&lanes[1]), P::load(&lanes[2])]
}

#[inline(always)]
fn load9<P: Pack>(lanes: &[[Lanes<P::Number>; 3]; 3]) -> [[P; 3]; 3] {
    [load3(&lanes[0]), load3(&lanes[1]), load3(&lanes[2])]
}

impl<R: Real> WithSimd<R> for Update<'_, '_, R> {
    const WIDE_BINARY64: bool = false;
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(mut self) {
        let one = P::one();
        let (mut shapes, mut plastic_ratios, mut volumes) =
            ([[[one; 3]; 3]; TOGETHER], [one; TOGETHER], [one; TOGETHER]);
        let mut moduli = [Moduli::gather(self.materials, &[0; LANES], one); TOGETHER];
        for k in 0..TOGETHER {
            let group = &self.groups[k];
            let (_, plastic_ratio) = self.motions[k].v_and_plastic_ratio::<P>();
            let f = self.particles.f_e_columns::<P>(group);
            let Constants { volume, stiffness, object } = self.particles.constants(group);
            (plastic_ratios[k], volumes[k]) = (plastic_ratio, P::load(&volume));
            moduli[k] = Moduli::gather(self.materials, &object, P::load(&stiffness));
            shapes[k] = match self.deformation {
                Deformation::Step => {
                    let gradient = load9(&self.arrivals[k].gradient);
                    predict(&f, &still(&gradient, self.ballistic(k, volumes[k])), P::splat(self.dt))
                }
                Deformation::Refresh => f,
            };
        }

        let new = match self.deformation {
            Deformation::Step => deform(&shapes, &plastic_ratios, &volumes, &moduli),
            Deformation::Refresh => undeformed(&shapes, &plastic_ratios, &volumes, &moduli),
        };
        for k in 0..TOGETHER {
            self.finish(k, &new[k], volumes[k], &moduli[k]);
        }
    }
}

/// 0 where a particle is ballistic: it moves as a point, and keeps its F_E.
#[inline(always)]
fn still<P: Pack>(gradient: &Columns<P>, ballistic: P) -> Columns<P> {
    let zero = P::zero();
    let mut out = *gradient;
    for axis in 0..3 {
        for k in 0..3 {
            out[axis][k] = zero.if_less(ballistic, zero, gradient[axis][k]);
        }
    }
    out
}

impl<R: Real> Update<'_, '_, R> {
    /// 1 where the density on the grid is below a share of m / V0, else 0: nearly alone.
    #[inline(always)]
    fn ballistic<P: Pack<Number = R>>(&self, k: usize, volume: P) -> P {
        let (_, m) = self.motions[k].x_and_mass::<P>();
        let own = m * self.ballistic_below;
        let density = P::load(&self.arrivals[k].density);
        (density * volume).if_less(own, P::one(), P::zero())
    }

    /// Writes a group, and counts it.
    #[inline(always)]
    fn finish<P: Pack<Number = R>>(&mut self, k: usize, new: &Deformed<P>, volume: P, moduli: &Moduli<P>) {
        let (zero, dt) = (P::zero(), P::splat(self.dt));
        let (group, arrival) = (&self.groups[k], &self.arrivals[k]);
        let ([x, y, z], mass) = self.motions[k].x_and_mass::<P>();
        let (v, drift) = (load3(&arrival.v), load3::<P>(&arrival.drift));
        let c = load9(&arrival.c);
        let mut position = [x + dt * drift[0], y + dt * drift[1], z + dt * drift[2]];
        if self.deformation == Deformation::Step && !self.attached.is_empty() {
            let ids = group.at.map(|at| self.particles.id[at as usize]);
            position = self.attached.hold(&ids[..group.count], &new.elastic, position);
        }
        let ballistic = self.ballistic(k, volume);
        let c = still(&c, ballistic);
        let mut v0_tau = new.volume_stress;
        for k in 0..6 {
            v0_tau[k] = zero.if_less(ballistic, zero, v0_tau[k]);
        }

        let plastic_ratio = new.plastic_ratio;
        let lanes = NewLanes { x: position, mass, v, plastic_ratio, f_e: new.elastic, c, v0_tau };
        self.particles.write(group, &lanes);

        let counts = [new.yielded, new.clamped, new.inverted, ballistic];
        let extremes = extremes(&new.elastic, new.hardening, &v, &c, volume / mass, moduli);
        self.tally.include(group.count, extremes, plastic_ratio, counts);
        self.given[k] = new.given.store();

        let mut node = position;
        for axis in 0..3 {
            let at = position[axis] * self.inverse_cell;
            node[axis] = match self.width {
                2 => first_node::<P, 2>(at),
                3 => first_node::<P, 3>(at),
                _ => first_node::<P, 4>(at),
            };
        }

        self.codes[k] = codes(&load3(&arrival.block), &node, self.periodic);
    }
}

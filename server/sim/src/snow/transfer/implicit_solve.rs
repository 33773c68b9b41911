//! Semi-implicit velocities: (M + beta dt² H) v = M v* (Stomakhin et al. 2013, eq. 9; Brasseur 2014,
//! eq. 2.7), H = d²Phi/dx², by MINRES in the mass inner product, matrix-free: H is indefinite.
//!
//! Reads velocities after forces and colliders; writes those of the end of the step. Components that
//! colliders hold keep their velocity: the solve is for the change of the others. Plastic flow is
//! frozen in the solve.

use std::marker::PhantomData;

use rayon::prelude::*;

use super::{
    grid_to_particles::{Gather, GatherGroup},
    grid_update::{GridStep, Hold, gather as gather_tiles},
    particle_update::{Arrival, Constants, Lane, constants},
    particles_to_grid::{BlockParticles, Coefficients as Rows, add, flush, row_weights},
    scheme::{FlipScheme, MlsScheme, Scheme},
    stencil::{Around, TILE, Walk},
    weights::axis_weights,
};
use crate::snow::{
    Integration, SnowSettings,
    grid::{
        blocks::{CELLS, Grid, NodeBlock, block_of, tile_len},
        sort::Sorter,
    },
    law::{
        constitutive::{Coefficients, Moduli, hardened},
        tangent::piola_change,
    },
    particles::{Group, Particles, quads, read},
    step::Forces,
};
use crate::{
    linalg::{MinresWorkspace, Outcome, SolveReport, Stop, WholeOperator, minres},
    math::{LANES, Pack, Real, Vec3, WithSimd, dispatch, svd},
};

/// Scratch memory of the solve.
#[derive(Clone, Debug, Default)]
pub(crate) struct ImplicitWorkspace<R: Real> {
    nodes: Vec<NodeBlock<R>>,
    tiles: Vec<R>,
    mass: Vec<R>,
    holds: Vec<Hold<R>>,
    b: Vec<Vec3<R>>,
    change: Vec<Vec3<R>>,
    minres: MinresWorkspace<R>,
}

/// What the operator reads.
pub(crate) struct Material<'a, R: Real> {
    pub(crate) settings: &'a SnowSettings,
    pub(crate) coefficients: &'a [Coefficients<R>],
    pub(crate) particles: &'a Particles<R>,
    pub(crate) sorter: &'a Sorter,
}

/// Replaces velocities after forces by those of the semi-implicit step, unless the solve fails.
pub(crate) fn solve<R: Real>(
    material: &Material<'_, R>,
    step: &GridStep<'_>,
    grid: &mut Grid<R>,
    work: &mut ImplicitWorkspace<R>,
) -> Result<Option<SolveReport>, Outcome> {
    let Integration::SemiImplicit { beta, stop } = material.settings.integration else { return Ok(None) };
    if beta <= 0.0 {
        return Ok(None);
    }
    let blocks = grid.node_blocks.len();
    let count = blocks * CELLS;
    work.prepare(step, grid, count);
    let ImplicitWorkspace { nodes, tiles, mass, holds, b, change, minres: scratch } = work;
    let scale = R::of(beta * step.dt * step.dt);
    let mut operator =
        Tangent { material, grid: &*grid, nodes, tiles, mass: &mass[..count], holds: &holds[..count], scale };
    // From v = v* + change: (M + beta dt² H) change = -beta dt² H v*.
    operator.load(None);
    operator.product();
    operator.right_hand_side(&mut b[..count]);
    change[..count].fill(Vec3::zeros());
    let report = minres(&mut operator, &mass[..count], &b[..count], &mut change[..count], stop, scratch);
    let usable = matches!(
        (report.outcome, stop),
        (Outcome::Converged, _) | (Outcome::IterationCap, Stop::Iterations(_))
    );
    if !usable {
        return Err(report.outcome);
    }
    let forces = step.forces;
    let Grid { nodes, changes, .. } = grid;
    nodes[..blocks].par_iter_mut().zip(change[..count].par_chunks(CELLS)).for_each(|(nodes, change)| {
        add_change(nodes, change);
    });
    if forces == Forces::Apart {
        changes[..blocks].par_iter_mut().zip(change[..count].par_chunks(CELLS)).for_each(
            |(nodes, change)| {
                add_change(nodes, change);
            },
        );
    }
    Ok(Some(report))
}

fn add_change<R: Real>(nodes: &mut NodeBlock<R>, change: &[Vec3<R>]) {
    for (node, change) in nodes.iter_mut().zip(change) {
        for k in 0..3 {
            node[k] += change[k];
        }
    }
}

impl<R: Real> ImplicitWorkspace<R> {
    fn prepare(&mut self, step: &GridStep<'_>, grid: &Grid<R>, count: usize) {
        if self.mass.len() < count {
            // As much room as the grid has, so that a moving front seldom allocates.
            let blocks = grid.nodes.len();
            let count = blocks * CELLS;
            self.minres.reserve(count);
            self.nodes.resize(blocks, [[R::zero(); 4]; CELLS]);
            self.mass.resize(count, R::one());
            self.holds.resize(count, Hold::Free);
            self.b.resize(count, Vec3::zeros());
            self.change.resize(count, Vec3::zeros());
        }
        if self.tiles.len() < grid.tiles.len() {
            self.tiles.resize(grid.tiles.len(), R::zero());
        }
        let least = R::of(step.least_mass);
        let work = (&mut self.mass[..count], &mut self.holds[..count]);
        let work = (work.0.par_chunks_mut(CELLS), work.1.par_chunks_mut(CELLS));
        (work.0, work.1, &grid.node_blocks, &grid.nodes[..count / CELLS]).into_par_iter().for_each(
            |(mass, holds, key, nodes)| {
                let block = block_of(*key);
                let near = step.near(block);
                for i in 0..CELLS {
                    let m = nodes[i][3];
                    // A node without mass stays still; any mass will do for it.
                    (mass[i], holds[i]) = if m > least { (m, Hold::Free) } else { (R::one(), Hold::All) };
                    if m > least && near != 0 {
                        holds[i] = step.hold(near, block, i, &nodes[i]);
                    }
                }
            },
        );
    }
}

/// M + beta dt² H, where colliders leave nodes free; M where they hold them.
struct Tangent<'a, R: Real> {
    material: &'a Material<'a, R>,
    grid: &'a Grid<R>,
    nodes: &'a mut Vec<NodeBlock<R>>,
    tiles: &'a mut Vec<R>,
    mass: &'a [R],
    holds: &'a [Hold<R>],
    scale: R,
}

impl<R: Real> Tangent<'_, R> {
    /// Takes the free part of `u`, or the velocities of the grid, as the field to be multiplied.
    fn load(&mut self, u: Option<&[Vec3<R>]>) {
        let (grid, holds) = (self.grid, self.holds);
        self.nodes.par_iter_mut().zip(&grid.node_blocks).enumerate().for_each(|(block, (nodes, _))| {
            for i in 0..CELLS {
                let at = block * CELLS + i;
                let [x, y, z, _] = grid.nodes[block][i];
                let v = u.map_or_else(|| Vec3::new(x, y, z), |u| holds[at].free(&u[at]));
                nodes[i] = [v.x, v.y, v.z, R::zero()];
            }
        });
    }

    /// H times the loaded field, left in tiles.
    fn product(&mut self) {
        let cubic = self.material.settings.kernel == crate::snow::Kernel::Cubic;
        match (self.material.settings.transfer, cubic) {
            (crate::snow::Transfer::Mls, true) => self.product_by::<MlsScheme, 4>(),
            (crate::snow::Transfer::Mls, false) => self.product_by::<MlsScheme, 3>(),
            (_, true) => self.product_by::<FlipScheme, 4>(),
            (_, false) => self.product_by::<FlipScheme, 3>(),
        }
    }

    fn product_by<S: Scheme, const N: usize>(&mut self) {
        let Self { material, grid, nodes, tiles, .. } = self;
        let Material { settings, coefficients, particles, sorter } = *material;
        let nodes = nodes.as_slice();
        let len = tile_len(N);
        let gather = Gather::of(settings, 0.0);
        let blocks = tiles[..grid.blocks.len() * len].par_chunks_mut(len);
        blocks.enumerate().for_each(|(b, out)| {
            out.fill(R::zero());
            let mut field = [[R::zero(); TILE]; 2];
            let around = Around { nodes: [nodes; 2], ..grid.around(&mut field) };
            let mut walk = Walk::new(sorter.sorted(), around, b);
            let first = sorter.starts[b] as usize;
            let order = &sorter.order[first..sorter.starts[b + 1] as usize];
            let block = BlockParticles { order, cells: &sorter.cells[b] };
            let (mut arrival, mut cell) = (Arrival::new(), 0);
            for start in (0..order.len()).step_by(LANES) {
                let group = Group::of(&order[start..]);
                dispatch(GatherGroup::<R, S, N> {
                    gather,
                    motion: &quads(&particles.motion, &group),
                    start: first + start,
                    count: group.count,
                    walk: &mut walk,
                    arrival: &mut arrival,
                    scheme: PhantomData,
                });
                let constants = constants(&particles.fixed, &particles.object, &group);
                let mut stress = arrival.gradient;
                dispatch(StressChange {
                    particles,
                    coefficients,
                    group: &group,
                    constants,
                    stress: &mut stress,
                });
                dispatch(ScatterStress::<R, S, N> {
                    settings,
                    particles,
                    group: &group,
                    block,
                    start,
                    stress: &stress,
                    cell: &mut cell,
                    out: &mut *out,
                    scheme: PhantomData,
                });
            }
        });
    }

    /// -beta dt² H v* on the free components.
    fn right_hand_side(&self, b: &mut [Vec3<R>]) {
        let scale = R::zero() - self.scale;
        self.collect(b, |at, product| self.holds[at].free(&(product * scale)));
    }

    /// `of(node, H u)` for every node.
    fn collect(&self, out: &mut [Vec3<R>], of: impl Fn(usize, Vec3<R>) -> Vec3<R> + Sync) {
        let width = self.material.settings.kernel.width();
        let tiles = self.tiles.as_slice();
        out.par_chunks_mut(CELLS).zip(&self.grid.behind).enumerate().for_each(|(block, (out, behind))| {
            let mut nodes = [[R::zero(); 4]; CELLS];
            gather_tiles(tiles, behind, width, &mut nodes);
            for i in 0..CELLS {
                let [x, y, z, _] = nodes[i];
                out[i] = of(block * CELLS + i, Vec3::new(x, y, z));
            }
        });
    }
}

impl<R: Real> WholeOperator<R> for Tangent<'_, R> {
    fn apply(&mut self, x: &[Vec3<R>], out: &mut [Vec3<R>]) {
        self.load(Some(x));
        self.product();
        self.collect(out, |at, product| x[at] * self.mass[at] + self.holds[at].free(&(product * self.scale)));
    }
}

/// V0 dP F^T of a group, dP from dF = (grad u) F.
struct StressChange<'a, R: Real> {
    particles: &'a Particles<R>,
    coefficients: &'a [Coefficients<R>],
    group: &'a Group,
    constants: Constants<R>,
    /// Enters: grad u, by columns; leaves: V0 dP F^T (J), by columns.
    stress: &'a mut [[Lane<R>; 3]; 3],
}

impl<R: Real> WithSimd<R> for StressChange<'_, R> {
    const WIDE_BINARY64: bool = false;
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let Self { particles, group, stress, .. } = self;
        let [.., jp] = read::<P, 1>(&particles.motion, group);
        let [xx, xy, xz, yx] = read::<P, 0>(&particles.shape, group);
        let [yy, yz, zx, zy] = read::<P, 1>(&particles.shape, group);
        let [zz, ..] = read::<P, 0>(&particles.affine, group);
        let f = [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]];
        let mut gradient = f;
        for axis in 0..3 {
            for k in 0..3 {
                gradient[axis][k] = P::load(&stress[axis][k]);
            }
        }
        let Constants { fixed, object } = &self.constants;
        let moduli = Moduli::gather(self.coefficients, object, P::load(&fixed[1]));
        let change = crate::snow::law::deform::product(&gradient, &f);
        let piola = piola_change(&svd(&f), &change, hardened(jp, &moduli), &moduli);
        let volume = P::load(&fixed[0]);
        for axis in 0..3 {
            for k in 0..3 {
                let sum = piola[0][k] * f[0][axis] + piola[1][k] * f[1][axis];
                stress[axis][k] = ((sum + piola[2][k] * f[2][axis]) * volume).store();
            }
        }
    }
}

/// Adds what the stresses of a group exert on nodes.
struct ScatterStress<'a, R: Real, S, const N: usize> {
    settings: &'a SnowSettings,
    particles: &'a Particles<R>,
    group: &'a Group,
    block: BlockParticles<'a>,
    start: usize,
    stress: &'a [[Lane<R>; 3]; 3],
    cell: &'a mut usize,
    out: &'a mut [R],
    scheme: PhantomData<S>,
}

impl<R: Real, S: Scheme, const N: usize> WithSimd<R> for ScatterStress<'_, R, S, N> {
    const WIDE_BINARY64: bool = false;
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let zero = P::zero();
        let mut rows = Rows::new();
        self.particles_rows::<P>(&mut rows);
        let Self { group, block, cell, out, .. } = self;
        let (mut sums, mut forces) = ([[zero; N]; N], [[zero; N]; N]);
        for lane in 0..group.count {
            while block.cells[*cell + 1] as usize <= self.start + lane {
                flush::<P, N>(&mut sums, out, *cell);
                flush::<P, N>(&mut forces, out, *cell);
                *cell += 1;
            }
            add::<P, S, N>(&rows, lane, &mut sums, &mut forces);
        }
        flush::<P, N>(&mut sums, out, *cell);
        flush::<P, N>(&mut forces, out, *cell);
    }
}

impl<R: Real, S: Scheme, const N: usize> ScatterStress<'_, R, S, N> {
    /// Rows of the group's particles.
    #[inline(always)]
    fn particles_rows<P: Pack<Number = R>>(&self, out: &mut Rows<R>) {
        let zero = P::zero();
        let [x, y, z, _] = read::<P, 0>(&self.particles.motion, self.group);
        let scale = R::of(1.0 / self.settings.cell);
        let moment = R::of(self.settings.kernel.inverse_moment() / self.settings.cell);
        let axes = [
            axis_weights::<P, N>(x * scale),
            axis_weights::<P, N>(y * scale),
            axis_weights::<P, N>(z * scale),
        ];
        let mut base = [zero; 3];
        for axis in 0..3 {
            let mut column = [zero; 3];
            for k in 0..3 {
                column[k] = P::load(&self.stress[axis][k]) * if S::SLOPES { scale } else { moment };
                base[k] -= column[k] * axes[axis].offset;
            }
            let quads = P::rows([column[0], column[1], column[2], zero]);
            if S::SLOPES {
                out.force[axis] = quads;
            } else {
                out.along[axis] = quads;
            }
        }
        if !S::SLOPES {
            out.base = P::rows([base[0], base[1], base[2], zero]);
        }
        out.wz = P::rows(axes[2].w);
        out.dz = P::rows(axes[2].d);
        row_weights::<P, S, N>(&axes, &mut out.rows);
    }
}

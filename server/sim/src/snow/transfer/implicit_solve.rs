//! Semi-implicit velocities: (M + beta dt² H) v = M v* (Stomakhin et al. 2013, eq. 9; Brasseur 2014,
//! eq. 2.7), H = d²Phi/dx², by MINRES in the mass inner product, matrix-free: H is indefinite.
//!
//! Reads velocities after forces and colliders; writes those of the end of the step. Components that
//! colliders hold keep their velocity: the solve is for the change of the others. Plastic flow is
//! frozen in the solve. What it would have given held components, colliders feel.

use std::marker::PhantomData;

use super::{
    context::StepContext,
    grid_to_particles::{Arrival, GridToGroup, InterpolationScale},
    grid_update::{GridStep, sum_tiles},
    hold::Hold,
    particles_to_grid::BlockParticles,
    scheme::{FlipScheme, MlsScheme, Scheme},
    stencil::{Stencil, StencilNodes, TILE},
    stress_change::{ScatterStress, StressChange},
};
use crate::{
    collide::BlockLoads,
    interrupt::Interrupt,
    linalg::{MinresWorkspace, Outcome, SolveReport, Stop, WholeOperator, minres},
    math::{LANES, Real, Vec3, array3, dispatch},
    parallel::{Own, per_block, per_block_mut, several_per_block, several_per_block_mut},
    snow::{
        grid::{CELLS, Grid, NodeBlock, Sorted, block_of, tile_len},
        model::SnowModel,
        particles::{Group, Particles},
        settings::{Forces, Integration, Kernel as Spline, Transfer},
    },
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
struct ImplicitSystem<'a, R: Real> {
    model: &'a SnowModel<R>,
    particles: &'a Particles<R>,
    sorted: Sorted<'a>,
}

/// Replaces velocities after forces by those of a semi-implicit step, if it is one. Where the solve
/// fails, nothing has moved. Adds to what blocks of nodes give to colliders.
pub(crate) fn solve_velocities<R: Real>(
    model: &SnowModel<R>,
    context: &StepContext<'_>,
    particles: &Particles<R>,
    sorted: Sorted<'_>,
    grid: &mut Grid<R>,
    (work, loads): (&mut ImplicitWorkspace<R>, &mut BlockLoads),
) -> Result<Option<SolveReport>, Outcome> {
    let Integration::SemiImplicit { beta, stop } = model.settings.integration else { return Ok(None) };
    if beta <= 0.0 {
        return Ok(None);
    }

    let system = ImplicitSystem { model, particles, sorted };

    let blocks = grid.node_blocks.len();
    let count = blocks * CELLS;
    work.prepare(&GridStep::of(model, context), grid, count);
    let ImplicitWorkspace { nodes, tiles, mass, holds, b, change, minres: scratch } = work;
    let scale = R::of(beta * context.sub_step.dt * context.sub_step.dt);
    let mut operator = StepOperator {
        system,
        grid: &*grid,
        nodes,
        tiles,
        mass: &mass[..count],
        holds: &holds[..count],
        scale,
        interrupt: context.interrupt,
    };

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

    let Grid { nodes, changes, .. } = grid;
    let changes = (model.settings.transfer.forces() == Forces::Apart).then_some(changes);
    for nodes in [Some(nodes), changes].into_iter().flatten() {
        let fields = (per_block_mut(nodes), several_per_block(change, CELLS));
        Own::whole(blocks, 1).each(fields, |_, (nodes, change)| add_change(nodes, change));
    }
    if !context.colliders.is_empty() {
        let system = ImplicitSystem { model, particles, sorted };
        tell_colliders(model, context, system, grid, (work, loads), scale);
    }

    Ok(Some(report))
}

/// Tells colliders what the solve would have given to components that they hold: beta dt² H v there.
fn tell_colliders<R: Real>(
    model: &SnowModel<R>,
    context: &StepContext<'_>,
    system: ImplicitSystem<'_, R>,
    grid: &Grid<R>,
    (work, loads): (&mut ImplicitWorkspace<R>, &mut BlockLoads),
    scale: R,
) {
    let count = grid.node_blocks.len() * CELLS;
    let ImplicitWorkspace { nodes, tiles, mass, holds, b, .. } = work;
    let (mass, holds, interrupt) = (&mass[..count], &holds[..count], context.interrupt);
    let mut operator = StepOperator { system, grid, nodes, tiles, mass, holds, scale, interrupt };
    operator.load(None);
    operator.product();
    operator.collect(&mut b[..count], |_, product| product * scale);

    let step = GridStep::of(model, context);
    let least = R::of(step.least_mass);
    let felt = several_per_block_mut(loads.felt_mut(), context.colliders.len());
    let given = several_per_block(&*b, CELLS);
    let fields = (felt, per_block(&grid.node_blocks), per_block(&grid.nodes), given);
    Own::whole(count / CELLS, 1).each(fields, |place, (felt, key, nodes, given)| {
        let block = block_of(*key);
        let near = step.near(block);
        if near == 0 {
            return;
        }
        for (i, node) in nodes.iter().enumerate().filter(|(_, node)| node[3] > least) {
            let held = given[i] - holds[place * CELLS + i].free(&given[i]);
            step.give((near, &mut *felt), block, (i, node), array3(&held));
        }
    });
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
        let Self { mass, holds, .. } = self;
        let (mass, holds) = (several_per_block_mut(mass, CELLS), several_per_block_mut(holds, CELLS));
        let fields = (mass, holds, per_block(&grid.node_blocks), per_block(&grid.nodes));
        Own::whole(count / CELLS, 1).each(fields, |_, (mass, holds, key, nodes)| {
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
        });
    }
}

/// M + beta dt² H, where colliders leave nodes free; M where they hold them.
struct StepOperator<'a, R: Real> {
    system: ImplicitSystem<'a, R>,
    grid: &'a Grid<R>,
    nodes: &'a mut Vec<NodeBlock<R>>,
    tiles: &'a mut Vec<R>,
    mass: &'a [R],
    holds: &'a [Hold<R>],
    /// beta dt² (s²).
    scale: R,
    interrupt: &'a Interrupt,
}

impl<R: Real> StepOperator<'_, R> {
    /// Takes the free part of `u`, or the velocities of the grid, as the field to be multiplied.
    fn load(&mut self, u: Option<&[Vec3<R>]>) {
        let (grid, holds) = (self.grid, self.holds);
        Own::whole(grid.node_blocks.len(), 1).each(per_block_mut(self.nodes), |block, nodes| {
            for i in 0..CELLS {
                let at = block * CELLS + i;
                let [x, y, z, _] = grid.nodes[block][i];
                let v = u.map_or_else(|| Vec3::new(x, y, z), |u| holds[at].free(&u[at]));
                nodes[i] = [v.x, v.y, v.z, R::zero()];
            }
        });
    }

    /// H times the loaded field, left in tiles. Only forces matter, and those of APIC are those of FLIP.
    fn product(&mut self) {
        let settings = &self.system.model.settings;
        let cubic = settings.kernel == Spline::Cubic;
        match (settings.transfer, cubic) {
            (Transfer::Mls, true) => self.product_by::<MlsScheme, 4>(),
            (Transfer::Mls, false) => self.product_by::<MlsScheme, 3>(),
            (_, true) => self.product_by::<FlipScheme, 4>(),
            (_, false) => self.product_by::<FlipScheme, 3>(),
        }
    }

    fn product_by<S: Scheme, const N: usize>(&mut self) {
        let Self { system, grid, nodes, tiles, .. } = self;
        let ImplicitSystem { model, particles, sorted } = *system;
        let SnowModel { settings, materials, .. } = model;
        let nodes = nodes.as_slice();
        let len = tile_len(N);
        let scale = InterpolationScale::of(settings, 0.0);
        Own::whole(grid.blocks.len(), 1).each(several_per_block_mut(tiles, len), |b, out| {
            out.fill(R::zero());
            let mut field = [[R::zero(); TILE]; 2];
            let around = StencilNodes { nodes: [nodes; 2], ..StencilNodes::of(grid, &mut field) };
            let mut stencil = Stencil::new(sorted, around, b);
            let (first, order) = (sorted.starts[b] as usize, sorted.places(b));
            let block = BlockParticles { order, cells: &sorted.cells[b] };
            let (mut arrival, mut cell) = (Arrival::new(), 0);

            for start in (0..order.len()).step_by(LANES) {
                let group = Group::of(&order[start..]);
                dispatch(GridToGroup::<R, S, N> {
                    scale,
                    motion: &particles.motion(&group),
                    start: first + start,
                    count: group.count,
                    stencil: &mut stencil,
                    arrival: &mut arrival,
                    scheme: PhantomData,
                });

                let constants = particles.constants(&group);
                let mut stress = arrival.gradient;
                dispatch(StressChange {
                    particles,
                    materials,
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
        let width = self.system.model.settings.kernel.width();
        let tiles = self.tiles.as_slice();
        let blocks = Own::whole(out.len() / CELLS, 1);
        let fields = (several_per_block_mut(out, CELLS), per_block(&self.grid.behind));
        blocks.each(fields, |block, (out, behind)| {
            let mut nodes = [[R::zero(); 4]; CELLS];
            sum_tiles(tiles, behind, width, &mut nodes);
            for i in 0..CELLS {
                let [x, y, z, _] = nodes[i];
                out[i] = of(block * CELLS + i, Vec3::new(x, y, z));
            }
        });
    }
}

impl<R: Real> WholeOperator<R> for StepOperator<'_, R> {
    fn apply(&mut self, x: &[Vec3<R>], out: &mut [Vec3<R>]) {
        self.load(Some(x));
        self.product();
        self.collect(out, |at, product| x[at] * self.mass[at] + self.holds[at].free(&(product * self.scale)));
    }

    fn is_interrupted(&self) -> bool {
        self.interrupt.is_requested()
    }
}

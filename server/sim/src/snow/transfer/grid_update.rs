//! Grid update: momenta to velocities, gravity, the medium, colliders (Stomakhin et al. 2013, steps 4 to 6).
//!
//! Reads tiles of the blocks of particles behind each block of nodes, in their order; writes
//! velocities after forces and colliders, and, for FLIP, their change in the step.

use super::{context::StepContext, hold::Hold, medium::Medium};
use crate::{
    collide::{BlockLoads, Collider, Contact, Corner, Felt, velocity_after},
    math::{
        LANES, Pack, Real, WithSimd,
        array::{dot, minus},
        dispatch,
    },
    parallel::{self, Own, per_block, per_block_mut, several_per_block_mut},
    snow::{
        grid::{
            CELLS, Coordinate, Grid, NONE, NodeBlock, SIDE, TILE_ROW, block_of, corner, node_of, tile_len,
        },
        model::SnowModel,
        settings::Forces,
    },
};

/// Roundings that a velocity which answered to several colliders may be off by.
const ROUNDINGS: f64 = 8.0;

/// What does not change from node to node.
pub(crate) struct GridStep<'a> {
    /// Nodes per axis of the kernel.
    width: usize,
    forces: Forces,
    /// Cell size h (m).
    cell: f64,
    /// Drag of the medium (1/s).
    drag: f64,
    context: &'a StepContext<'a>,
    /// Mass (kg) below which a node carries no velocity.
    pub(crate) least_mass: f64,
    /// Mass (kg) of the lightest particle: it takes at most the share m_i / m_p of a node's velocity.
    lightest: f64,
}

/// Sums and extremes over nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct GridDiagnostics {
    /// Mass on all nodes (kg).
    pub(crate) mass: f64,
    /// Magnitudes of momenta (kg m/s) of nodes that carry no velocity.
    pub(crate) dropped: f64,
    /// Square of the fastest node's speed (m²/s²), and the node; NaN when one is not finite. Forces
    /// by slopes make a node that a particle only just reaches arbitrarily fast, of which the
    /// particle takes next to nothing: a light node counts by the share that a particle may take.
    pub(crate) speed2: f64,
    pub(crate) fastest: [i32; 3],
    /// Nodes within a collider.
    pub(crate) contacts: u64,
    /// What the medium did (J): its impulse on each node times the velocity after it, and times the wind.
    pub(crate) medium_work: f64,
    pub(crate) wind_work: f64,
}

impl GridDiagnostics {
    /// What is added up over blocks: mass, momenta that were dropped, and both works of the medium.
    pub(crate) fn sums(&self) -> [f64; 4] {
        [self.mass, self.dropped, self.medium_work, self.wind_work]
    }
}

/// Momenta and impulses of all nodes to velocities at the end of a step; `diagnostics` is scratch. Writes what each block gives
/// to each collider.
pub(crate) fn update_grid<R: Real>(
    model: &SnowModel<R>,
    context: &StepContext<'_>,
    grid: &mut Grid<R>,
    diagnostics: &mut Vec<GridDiagnostics>,
    loads: &mut BlockLoads,
) -> GridDiagnostics {
    GridStep::of(model, context).run(grid, diagnostics, loads)
}

impl<'a> GridStep<'a> {
    /// A step on the grid of a model.
    pub(crate) fn of<R: Real>(model: &SnowModel<R>, context: &'a StepContext<'a>) -> Self {
        let SnowModel { settings, least_mass, .. } = model;
        Self {
            width: settings.kernel.width(),
            forces: settings.transfer.forces(),
            cell: settings.cell,
            drag: settings.drag,
            context,
            least_mass: least_mass * R::ROUNDING * R::ROUNDING,
            lightest: *least_mass,
        }
    }
}

impl GridStep<'_> {
    fn run<R: Real>(
        &self,
        grid: &mut Grid<R>,
        diagnostics: &mut Vec<GridDiagnostics>,
        loads: &mut BlockLoads,
    ) -> GridDiagnostics {
        let Grid { node_blocks, behind, tiles, impulses, nodes, changes, written_blocks, .. } = grid;
        written_blocks.clone_from(node_blocks);
        let count = node_blocks.len();
        diagnostics.resize(count, GridDiagnostics::default());
        let (tiles, impulses) = (tiles.as_slice(), impulses.as_slice());
        let changes = match self.forces {
            Forces::Fused => None,
            Forces::Apart => Some(per_block_mut(changes)),
        };
        let colliders = self.context.colliders.len();
        let felt = several_per_block_mut(loads.sized_for(count, colliders), colliders);
        let (nodes, sums) = (per_block_mut(nodes), (per_block_mut(diagnostics), felt));
        let fields = (nodes, sums, per_block(node_blocks), per_block(behind), changes);
        Own::whole(count, 1).each(fields, |_, (nodes, (diagnostics, felt), key, behind, mut changes)| {
            sum_tiles(tiles, behind, self.width, nodes);
            if let Some(changes) = changes.as_deref_mut() {
                sum_tiles(impulses, behind, self.width, changes);
            }
            *diagnostics = self.velocities(block_of(*key), nodes, changes, felt);
        });

        collect(&diagnostics[grid.own_nodes.clone()])
    }

    /// Momenta and impulses of a block to velocities and their changes.
    fn velocities<R: Real>(
        &self,
        block: Coordinate,
        nodes: &mut NodeBlock<R>,
        mut changes: Option<&mut NodeBlock<R>>,
        felt: &mut [Felt],
    ) -> GridDiagnostics {
        felt.fill(Felt::default());
        let mut diagnostics = GridDiagnostics::default();
        let near = self.near(block);

        let kick = self.context.gravity.map(|g| R::of(g * self.context.sub_step.dt));
        let medium = Medium::over(self.drag, self.context.wind, self.context.sub_step.dt);
        let least = R::of(self.least_mass);
        for i in 0..CELLS {
            let [px, py, pz, m] = nodes[i];
            diagnostics.mass += m.to_f64();
            if m > least {
                let inverse = R::one() / m;
                let mut v = [px * inverse, py * inverse, pz * inverse];
                let before = v;
                if let Some(impulses) = &changes {
                    for c in 0..3 {
                        v[c] += impulses[i][c] * inverse;
                    }
                }
                for c in 0..3 {
                    v[c] += kick[c];
                }
                if let Some(medium) = &medium {
                    let [work, of_wind] = medium.act(&mut v, m);
                    diagnostics.medium_work += work;
                    diagnostics.wind_work += of_wind;
                }

                if near != 0 {
                    diagnostics.contacts += u64::from(self.collide((near, &mut *felt), block, i, &mut v, m));
                }

                nodes[i] = [v[0], v[1], v[2], m];
                if let Some(changes) = &mut changes {
                    changes[i] = [v[0] - before[0], v[1] - before[1], v[2] - before[2], R::zero()];
                }

                let share = (m.to_f64() / self.lightest).min(1.0);
                let speed2 = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).to_f64() * share * share;
                // A NaN is not below or equal to anything, and stays.
                if (speed2 > diagnostics.speed2 || speed2.is_nan()) && !diagnostics.speed2.is_nan() {
                    (diagnostics.speed2, diagnostics.fastest) = (speed2, node_of(block, i));
                }
            } else {
                let momentum = [px, py, pz].map(Real::to_f64);
                diagnostics.dropped += momentum.iter().map(|p| p * p).sum::<f64>().sqrt();
                if m.to_f64() < 0.0 || m.to_f64().is_nan() {
                    (diagnostics.speed2, diagnostics.fastest) = (f64::NAN, node_of(block, i));
                }
                nodes[i] = [R::zero(), R::zero(), R::zero(), m];
                if let Some(changes) = &mut changes {
                    changes[i] = [R::zero(); 4];
                }
            }
        }

        diagnostics
    }

    /// Colliders that may reach a node of the block, one bit each; past 63 they share the last.
    pub(crate) fn near(&self, block: Coordinate) -> u64 {
        let half = 0.5 * (SIDE - 1) as f64;
        let center = block.map(|c| (f64::from(c * SIDE as i32) + half) * self.cell);
        let radius = half * 3.0_f64.sqrt() * self.cell;
        let reach = |(i, c): (usize, &Collider)| {
            if c.distance(center, self.context.sub_step.end).0 <= radius + c.margin {
                1 << i.min(63)
            } else {
                0
            }
        };
        self.context.colliders.iter().enumerate().map(reach).fold(0, |all, bit| all | bit)
    }

    /// Lets the velocity of a node of a mass answer to colliders, which feel it; says whether it was inside one.
    fn collide<R: Real>(
        &self,
        (near, felt): (u64, &mut [Felt]),
        block: Coordinate,
        i: usize,
        v: &mut [R; 3],
        m: R,
    ) -> bool {
        let place = node_of(block, i).map(|c| f64::from(c) * self.cell);
        let (before, mut corner) = (*v, Corner::default());
        let impulse = |v: [R; 3], from: [R; 3]| {
            let [v, from] = [v, from].map(|v| v.map(Real::to_f64));
            minus(v, from).map(|dv| m.to_f64() * dv)
        };
        let mut last = 0;
        for (k, collider) in
            self.context.colliders.iter().enumerate().filter(|(k, _)| near >> (*k).min(63) & 1 == 1)
        {
            debug_assert!(k < self.context.colliders.len());
            let (distance, normal) = collider.distance(place, self.context.sub_step.end);
            if distance <= collider.margin {
                let moving = collider.velocity_at(place, self.context.sub_step.end);
                let old = *v;
                *v = velocity_after(collider, moving, v.map(Real::to_f64), normal).map(R::of);
                felt[k].take(collider, impulse(*v, old), place, moving);
                felt[k].count();
                last = k;
                corner.add(collider, normal, moving);
            }
        }

        if corner.count() > 1 {
            let [before, after] = [before, *v].map(|v| v.map(Real::to_f64));
            let settled = corner.velocity(before, after, ROUNDINGS * R::ROUNDING);
            if settled != after {
                let old = *v;
                *v = settled.map(R::of);
                // What all of them need together is told of the last one.
                let collider = &self.context.colliders[last];
                let moving = collider.velocity_at(place, self.context.sub_step.end);
                felt[last].take(collider, impulse(*v, old), place, moving);
            }
        }

        corner.count() > 0
    }
}

impl GridStep<'_> {
    /// What colliders leave free of a node whose velocity has answered to them.
    pub(crate) fn hold<R: Real>(&self, near: u64, block: Coordinate, i: usize, v: &[R; 4]) -> Hold<R> {
        let place = node_of(block, i).map(|c| f64::from(c) * self.cell);
        let mut hold = Hold::<f64>::Free;
        for (_, collider) in
            self.context.colliders.iter().enumerate().filter(|(k, _)| near >> (*k).min(63) & 1 == 1)
        {
            if let Some(normal) = self.holds(collider, place, v) {
                hold = hold.and(collider.contact, normal);
            }
        }

        hold.of()
    }

    /// The normal of a collider at a place (m) within it, unless what has that velocity leaves it freely.
    fn holds<R: Real>(&self, collider: &Collider, place: [f64; 3], v: &[R; 4]) -> Option<[f64; 3]> {
        let (distance, normal) = collider.distance(place, self.context.sub_step.end);
        let moving = collider.velocity_at(place, self.context.sub_step.end);
        // A speed that moves the node by less than it is rounded by is none: of what was pushed with great
        // forces, as much may be left.
        let least = self.cell / self.context.sub_step.dt;
        let leaving: f64 = (0..3).map(|k| (v[k].to_f64() - moving[k]) * normal[k]).sum();
        let scale: f64 = (0..3).map(|k| v[k].to_f64().abs()).fold(least, f64::max);
        let free = collider.contact == Contact::Separating && leaving > ROUNDINGS * R::ROUNDING * scale;
        (distance <= collider.margin && !free).then_some(normal)
    }

    /// Tells colliders what keeps a node of a block where it is held: the impulse (N s) that a solve would have given it. Of
    /// several, each takes what is along its normal, and the last one the rest.
    pub(crate) fn give<R: Real>(
        &self,
        (near, felt): (u64, &mut [Felt]),
        block: Coordinate,
        (i, v): (usize, &[R; 4]),
        impulse: [f64; 3],
    ) {
        let place = node_of(block, i).map(|c| f64::from(c) * self.cell);
        let (mut rest, mut last) = (impulse, None::<(usize, [f64; 3])>);
        let colliders = self.context.colliders;
        let mut take = |k: usize, part: [f64; 3]| {
            let moving = colliders[k].velocity_at(place, self.context.sub_step.end);
            felt[k].take(&colliders[k], part, place, moving);
        };
        for (k, collider) in colliders.iter().enumerate().filter(|(k, _)| near >> (*k).min(63) & 1 == 1) {
            let Some(normal) = self.holds(collider, place, v) else { continue };
            if let Some((before, normal)) = last.replace((k, normal)) {
                let share = dot(rest, normal);
                let part = normal.map(|n| share * n);
                take(before, part);
                rest = minus(rest, part);
            }
        }
        if let Some((last, _)) = last {
            take(last, rest);
        }
    }
}

/// Adds up diagnostics of blocks, in their order.
fn collect(diagnostics: &[GridDiagnostics]) -> GridDiagnostics {
    let mut total = GridDiagnostics::default();
    for block in diagnostics {
        total.contacts += block.contacts;
        if (block.speed2 > total.speed2 || block.speed2.is_nan()) && !total.speed2.is_nan() {
            (total.speed2, total.fastest) = (block.speed2, block.fastest);
        }
    }

    [total.mass, total.dropped, total.medium_work, total.wind_work] =
        parallel::sum_by(diagnostics, &GridDiagnostics::sums);
    total
}

/// Adds the parts of eight tiles that lie over a block of nodes.
pub(crate) fn sum_tiles<R: Real>(tiles: &[R], behind: &[u32; 8], width: usize, nodes: &mut NodeBlock<R>) {
    dispatch(SumTiles { tiles, behind, width, nodes });
}

struct SumTiles<'a, R> {
    tiles: &'a [R],
    behind: &'a [u32; 8],
    width: usize,
    nodes: &'a mut NodeBlock<R>,
}

impl<R: Real> WithSimd<R> for SumTiles<'_, R> {
    const WIDE_BINARY64: bool = false;
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let side = SIDE + self.width - 1;
        let mut rows = [P::zero(); SIDE * SIDE];
        for (i, &index) in self.behind.iter().enumerate() {
            if index == NONE {
                continue;
            }
            let start = index as usize * tile_len(self.width);
            let tile = &self.tiles[start..start + tile_len(self.width)];
            let [ox, oy, oz] = corner(i).map(|c| c as usize * SIDE);
            for x in 0..SIDE.min(side - ox) {
                for y in 0..SIDE.min(side - oy) {
                    let at = ((ox + x) * side + oy + y) * TILE_ROW + 4 * oz;
                    let row = P::load((&tile[at..at + LANES]).try_into().expect("sixteen numbers"));
                    rows[x * SIDE + y] += row;
                }
            }
        }

        let (out, _) = self.nodes.as_flattened_mut().as_chunks_mut::<LANES>();
        for (out, row) in out.iter_mut().zip(rows) {
            *out = row.store();
        }
    }
}

/// Square of the fastest node's speed (m²/s²), and the node; NaN when one is not finite. A light node
/// counts by the share that the lightest particle may take, as in [`GridDiagnostics`].
pub(crate) fn fastest_node<R: Real>(grid: &Grid<R>, lightest: f64) -> (f64, [i32; 3]) {
    let mut fastest = (0.0, [0; 3]);
    for (key, nodes) in grid.node_blocks.iter().zip(&grid.nodes) {
        for (i, node) in nodes.iter().enumerate() {
            let share = (node[3].to_f64() / lightest).min(1.0);
            let speed2 = node[..3].iter().map(|v| v.to_f64() * v.to_f64()).sum::<f64>() * share * share;
            if speed2 > fastest.0 || speed2.is_nan() {
                fastest = (speed2, node_of(block_of(*key), i));
                if speed2.is_nan() {
                    return fastest;
                }
            }
        }
    }

    fastest
}

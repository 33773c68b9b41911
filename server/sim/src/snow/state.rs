//! The state of snow, what a checkpoint saves; and what a step works with.

use super::{
    book::Book,
    bound::{Culprits, Extremes},
    grid::{Grid, Sorter},
    particles::Particles,
    ranks::SnowRanks,
    transfer::{ChunkDiagnostics, GridDiagnostics, ImplicitWorkspace},
};
use crate::{
    collide::{BlockLoads, Felt},
    held_length::HeldLength,
    math::Real,
    report::{Notices, Work},
};

/// Kinetic, elastic, gravitational energy; momentum; angular momentum; mass; energy of affine velocities; moment; and the
/// gravitational energy of each particle without its sign.
pub(super) const SUMS: usize = 15;

/// What changes from step to step, and what a checkpoint saves: particles. All else follows from
/// them and from the model.
#[derive(Clone, Debug)]
pub struct SnowState<R: Real> {
    pub(super) particles: Particles<R>,
    /// How long its steps are.
    pub(super) hold: HeldLength,
    /// What energy they gained.
    pub(super) book: Book,
}

/// What the steps since the step of the world began add up to.
#[derive(Clone, Debug, Default)]
pub(super) struct Totals {
    /// What they cost.
    pub(super) spent: Work,
    /// Energy (J) that hardening, given forces and the wind gave.
    pub(super) given: f64,
    /// Work (J) of given forces, which is part of what was given, and of the medium.
    pub(super) external: f64,
    /// Particles that went through a collider.
    pub(super) notices: Notices,
}

/// What colliders feel.
#[derive(Clone, Debug, Default)]
pub(super) struct Loads {
    /// What blocks of nodes and of particles gave to each collider in the last step, and the sums over all nodes.
    pub(super) nodes: BlockLoads,
    pub(super) particles: BlockLoads,
    of_nodes: Vec<Felt>,
    /// What each collider felt since the step of the world began.
    pub(super) felt: Vec<Felt>,
}

/// What follows from the state, and scratch memory: a step allocates nothing once it has its size.
#[derive(Clone, Debug, Default)]
pub struct SnowWorkspace<R: Real> {
    /// The order of the particles.
    pub(super) sorter: Sorter,
    /// The grid as the last step left it.
    pub(super) grid: Grid<R>,
    /// What bounds the next step.
    pub(super) extremes: Extremes,
    /// The particles of the extremes, where they were looked for.
    pub(super) culprits: Option<Culprits>,
    /// What each chunk of particles told in the last step.
    pub(super) chunk_diagnostics: Vec<ChunkDiagnostics>,
    /// Energy (J) that hardening gave the particles of each block in the last step.
    pub(super) block_given: Vec<f64>,
    /// What the grid told in the last step, and each of its blocks.
    pub(super) grid_diagnostics: GridDiagnostics,
    pub(super) block_diagnostics: Vec<GridDiagnostics>,
    /// The ranks that step it together; none where one does.
    pub(super) ranks: Option<SnowRanks>,
    /// A quad per particle while places are renewed.
    pub(super) spare: Vec<[R; 4]>,
    pub(super) implicit: ImplicitWorkspace<R>,
    /// Sums over the particles of each block.
    pub(super) partials: Vec<[f64; SUMS]>,
    pub(super) totals: Totals,
    /// Forces on particles (N), in the user's numbering; none where all are 0.
    pub(super) forces: Vec<[f64; 3]>,
    pub(super) loads: Loads,
}

impl<R: Real> SnowWorkspace<R> {
    /// The ranks, where each has its part.
    pub(super) fn divided(&self) -> Option<&SnowRanks> {
        self.ranks.as_ref().filter(|ranks| ranks.is_divided())
    }

    /// Adds up what all nodes gave to each collider.
    pub(super) fn sum_node_loads(&mut self) {
        let Self { loads: Loads { nodes, of_nodes, felt, .. }, ranks, grid, .. } = self;
        let share = ranks.as_ref().map(|ranks| &ranks.nodes);
        of_nodes.clear();
        let sum = |collider| nodes.sum_own(grid.own_nodes.clone(), share, collider);
        of_nodes.extend((0..felt.len()).map(sum));
    }

    /// Takes over what all nodes and particles gave to each collider in a step.
    pub(super) fn take_loads(&mut self) {
        let Self { loads: Loads { particles, of_nodes, felt, .. }, ranks, grid, .. } = self;
        let share = ranks.as_ref().map(|ranks| &ranks.blocks);
        for (collider, (felt, of_nodes)) in felt.iter_mut().zip(&*of_nodes).enumerate() {
            felt.add(of_nodes);
            felt.add(&particles.sum_own(0..grid.blocks.len(), share, collider));
        }
    }

    /// Bytes in use by the order and the grid.
    pub(super) fn bytes(&self) -> usize {
        self.sorter.bytes() + self.grid.bytes() + self.spare.capacity() * size_of::<[R; 4]>()
    }
}

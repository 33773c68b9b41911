//! The order of particles: renewed after a step, or made from nothing.
//!
//! Reads where particles are, or where they went; writes the sorted order, the blocks of the grid,
//! and now and then the places of the particles.

use crate::{
    math::Real,
    snow::{
        grid::{ROOM, within_reach},
        model::SnowModel,
        particles::Particles,
        state::SnowWorkspace,
        transfer::{ChunkDiagnostics, weights},
    },
};

/// Sorts from nothing; a particle out of reach is left to [`lost`](super::failure::lost).
pub(crate) fn sort_anew<R: Real>(
    model: &SnowModel<R>,
    particles: &Particles<R>,
    work: &mut SnowWorkspace<R>,
) {
    let settings = &model.settings;
    let inverse_cell = R::of(1.0 / settings.cell);
    let SnowWorkspace { sorter, grid, first_nodes, .. } = work;
    first_nodes.clear();
    first_nodes.extend((0..particles.len()).map(|at| {
        particles
            .x(at)
            .map(|x| weights(settings.kernel, x * inverse_cell).0)
            .map(|node| if within_reach(node) { node } else { 0 })
    }));
    sorter.rebuild(first_nodes, &particles.id, grid, settings.periodic);

    // Seldom needed again, and twelve bytes per particle.
    *first_nodes = Vec::new();

    let spare = work.grid.blocks.len() + ROOM;
    work.sorter.reserve(spare);
    work.grid.reserve(spare);
    work.chunk_diagnostics.reserve(spare);
    work.partials.reserve(spare);
    work.block_given.reserve(spare);
    work.block_diagnostics.reserve(8 * spare);

    work.culprits = None;
    work.chunk_diagnostics.clear();
    work.chunk_diagnostics.resize(work.sorter.sorted().chunks.count(), ChunkDiagnostics::default());
}

/// Puts particles in the sorted order, so that those of a block lie together again.
pub(crate) fn renew_places<R: Real>(particles: &mut Particles<R>, work: &mut SnowWorkspace<R>) {
    particles.permute(&work.sorter.order, &mut work.spare);
    work.sorter.renumber(&mut particles.id, &mut particles.object);
}

/// The order after a step; false where a particle went further than a block, and all were sorted
/// anew.
pub(crate) fn renew_order<R: Real>(
    model: &SnowModel<R>,
    particles: &mut Particles<R>,
    work: &mut SnowWorkspace<R>,
) -> bool {
    let followed = work.sorter.renew(&particles.id, &mut work.grid, model.settings.periodic);
    if !followed {
        sort_anew(model, particles, work);
    }
    if 4 * work.sorter.moved > particles.len() {
        renew_places(particles, work);
    }
    followed
}

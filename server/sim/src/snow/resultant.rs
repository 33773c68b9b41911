//! What acts on particles at the state as it is: by the transfer of a step, of particles at rest, in a second.
//!
//! What particles give to nodes is linear in the time step: without velocities, the momenta after 1 s are the forces (N).
//! Enters: snow between two steps. Leaves: the force on each node, and by its acceleration that on each particle. Colliders are
//! not in it.

use super::{
    body::Snow,
    grid::{CELLS, Grid, key_and_cell},
    model::SnowModel,
    particles::Particles,
    settings::Forces,
    transfer::{particles_to_grid, sum_tiles, weights},
};
use crate::{
    math::Real,
    parallel::{Own, per_block, per_block_mut},
    surroundings::Surroundings,
};

/// What acts on the particles of snow.
pub(super) struct Resultant<'a, R: Real> {
    model: &'a SnowModel<R>,
    particles: &'a Particles<R>,
    /// Forces by calls (N), in the user's numbering; none where all are 0.
    given: &'a [[f64; 3]],
    around: &'a Surroundings<'a>,
    /// Forces of the stress (N) and masses (kg), on nodes.
    grid: Grid<R>,
    /// Mass (kg) below which a node carries nothing.
    least: f64,
}

impl<R: Real> Snow<R> {
    /// What acts on its particles now.
    ///
    /// # Panics
    /// When several ranks have begun to step it: each has a part of the particles.
    pub(super) fn resultant<'a>(&'a self, around: &'a Surroundings<'a>) -> Resultant<'a, R> {
        let Self { model, state, work } = self;
        let least = model.least_mass * R::ROUNDING * R::ROUNDING;
        Resultant {
            model,
            particles: &state.particles,
            given: &work.forces,
            around,
            grid: self.forces_on_nodes(),
            least,
        }
    }

    /// The grid with the force of the stress (N) and the mass (kg) on each node.
    ///
    /// # Panics
    /// When several ranks have begun to step it: each has a part of the particles.
    pub(super) fn forces_on_nodes(&self) -> Grid<R> {
        let Self { model, state, work } = self;
        assert!(work.divided().is_none(), "ranks have begun to step this snow: nobody has all of it");
        let (mut still, mut grid) = (state.particles.clone(), work.grid.bare());
        let zero = R::zero();
        for place in 0..still.len() {
            let (f_e, v0_tau) = (still.f_e(place), still.v0_tau(place));
            still.set_v(place, [zero; 3]);
            still.set_tensors(place, f_e, [[zero; 3]; 3], v0_tau);
        }
        particles_to_grid(model, &still, work.sorter.sorted(), &mut grid, 1.0);

        let (width, forces) = (model.settings.kernel.width(), model.settings.transfer.forces());
        let Grid { node_blocks, behind, tiles, impulses, nodes, .. } = &mut grid;
        let (tiles, impulses) = (tiles.as_slice(), impulses.as_slice());
        let fields = (per_block_mut(nodes), per_block(behind));
        Own::whole(node_blocks.len(), 1).each(fields, |_, (nodes, behind)| {
            sum_tiles(tiles, behind, width, nodes);
            if forces == Forces::Apart {
                let mut apart = [[R::zero(); 4]; CELLS];
                sum_tiles(impulses, behind, width, &mut apart);
                for (node, apart) in nodes.iter_mut().zip(apart) {
                    for c in 0..3 {
                        node[c] += apart[c];
                    }
                }
            }
        });
        grid
    }
}

impl<R: Real> Resultant<'_, R> {
    /// The acceleration (m/s²) of the particle at a place: sum w (f / m + g) over its nodes, what the medium adds at its own
    /// velocity, and what calls do.
    pub(super) fn acceleration(&self, place: usize) -> [f64; 3] {
        let Self { model, particles, given, around, .. } = self;
        let of_grid = self.of_grid(place);
        let v = particles.v(place).map(Real::to_f64);
        let mass = particles.mass(place).to_f64();
        let force = given.get(particles.id[place] as usize).copied().unwrap_or_default();
        let drag = model.settings.drag;
        [0, 1, 2].map(|c| of_grid[c] - drag * (v[c] - around.wind[c]) + force[c] / mass)
    }

    /// The force on it (N).
    pub(super) fn force(&self, place: usize) -> [f64; 3] {
        let mass = self.particles.mass(place).to_f64();
        self.acceleration(place).map(|c| mass * c)
    }

    /// Sum w (f / m + g) over the nodes of the particle at a place.
    fn of_grid(&self, place: usize) -> [f64; 3] {
        let Self { model, particles, around, grid, least, .. } = self;
        let settings = &model.settings;
        let inverse_cell = R::of(1.0 / settings.cell);
        let axes = particles.x(place).map(|x| weights(settings.kernel, x * inverse_cell));
        let (key, _) = key_and_cell([0, 1, 2].map(|a| axes[a].0), settings.periodic);
        let block = grid.blocks.binary_search(&key).expect("the block of each particle is there");
        let mut sum = [0.0; 3];
        for i in 0..64 {
            let steps = [i / 16, i / 4 % 4, i % 4];
            let w: f64 = (0..3).map(|a| axes[a].1[steps[a]].to_f64()).product();
            if w > 0.0 {
                let local = [0, 1, 2].map(|a| axes[a].0.rem_euclid(4) as usize + steps[a]);
                let corner = local.iter().fold(0, |corner, l| 2 * corner + l / 4);
                let node = local.iter().fold(0, |node, l| 4 * node + l % 4);
                let [x, y, z, m] = grid.nodes[grid.in_front[block][corner] as usize][node].map(Real::to_f64);
                if m > *least {
                    for (c, f) in [x, y, z].into_iter().enumerate() {
                        sum[c] += w * (f / m + around.gravity[c]);
                    }
                }
            }
        }
        sum
    }
}

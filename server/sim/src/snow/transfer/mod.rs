//! Between particles and the grid: there, new velocities, and back (Stomakhin et al. 2013, section 4).

pub(super) mod scheme;
pub(super) mod weights;
pub(super) mod stencil;
pub(super) mod particles_to_grid;
pub(super) mod grid_update;
pub(super) mod grid_to_particles;
pub(super) mod particle_update;
pub(super) mod implicit_solve;
pub(super) mod particle_collision;

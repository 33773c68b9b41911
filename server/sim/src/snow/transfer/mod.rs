//! From particles to the grid, new velocities there, and back (Stomakhin et al. 2013, section 4).

mod context;
mod scheme;
mod weights;
mod stencil;
mod tally;
mod particles_to_grid;
mod hold;
mod medium;
mod grid_update;
mod grid_to_particles;
mod stress_change;
mod implicit_solve;
mod particle_collision;
mod particle_update;

pub use weights::weights;

pub(super) use context::StepContext;
pub(super) use grid_to_particles::Arrival;
pub(super) use grid_update::{GridDiagnostics, fastest_node, sum_tiles, update_grid};
pub(super) use implicit_solve::{ImplicitWorkspace, solve_velocities};
pub(super) use particle_update::{Deformation, TOGETHER, Update, update_particles};
pub(super) use particles_to_grid::particles_to_grid;
pub(super) use tally::{ChunkDiagnostics, Tally};

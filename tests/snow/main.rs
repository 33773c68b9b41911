//! Snow against closed forms, golden data and itself: transfers, laws, motion, stability. `slow.rs` has what takes long.

mod reference;
mod affine;
mod blade;
mod brasseur;
mod clumps;
mod conservation;
mod corners;
mod dissipation;
mod errors;
mod forces;
mod free_fall;
mod friction;
mod solids;
mod volumes;
mod golden_step;
mod grid_to_particles;
mod shown_nodes;
mod kernels;
mod laws;
mod measured_limits;
mod periodic_bar;
mod placed;
mod semi_implicit;
mod spin;
mod statics;
mod step_bounds;

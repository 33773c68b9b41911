//! Snow against closed forms, golden data and itself: transfers, laws, motion, stability.

mod reference;
mod affine;
mod bars;
mod beam;
mod bounce;
mod brasseur;
mod conservation;
mod dissipation;
mod errors;
mod forces;
mod free_fall;
mod friction;
mod volumes;
mod golden_step;
mod grid_to_particles;
mod impact;
mod kernels;
mod laws;
mod manufactured;
mod measured_limits;
mod periodic_bar;
mod refinement;
mod semi_implicit;
mod statics;
mod step_bounds;

//! Snow: particles over a sparse grid, the material point method (Stomakhin et al. 2013).
//!
//! One file a stage, in the paper's order; [`Snow::step`] takes them.

mod settings;
mod material;
mod setup;
mod weight;
mod scheme;
mod response;
mod tangent;
pub mod constitutive;
mod deform;
mod particles;
mod keys;
mod grid;
mod depart;
mod sort;
mod runs;
mod particles_to_grid;
mod grid_update;
mod walk;
mod grid_to_particles;
mod update;
mod bound;
mod implicit;
mod collide;
mod step;
mod seed;
mod diagnose;
mod body;
mod view;

pub use body::{Snow, SnowStep, Surroundings};
pub use material::{Law, Material, Plasticity, Preset};
pub use settings::{Advection, Blend, Integration, Kernel, SnowSettings, TimeStep, Transfer};
pub use setup::{SnowError, SnowObject, SnowSetup};
pub use view::{GridNode, ParticleState};
pub use weight::weights;

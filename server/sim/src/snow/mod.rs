//! Snow: particles over a sparse grid, the material point method (Stomakhin et al. 2013).
//!
//! One file a stage, in the paper's order; [`Snow::step`] takes them.

mod settings;
mod law;
mod setup;
mod particles;
mod grid;
mod transfer;
mod bound;
mod step;
mod init;
mod diagnose;
mod body;
mod view;

pub use body::{Snow, SnowStep};
pub use law::constitutive_scalar;
pub use law::material::{Law, Material, Plasticity, Preset};
pub use settings::{Advection, Blend, Integration, Kernel, SnowSettings, TimeStep, Transfer};
pub use setup::{SnowError, SnowObject, SnowSetup};
pub use transfer::weights::weights;
pub use view::{GridNode, ParticleState};

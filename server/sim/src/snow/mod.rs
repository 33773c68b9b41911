//! Snow: particles over a sparse grid, the material point method (Stomakhin et al. 2013).

mod settings;
mod material;
mod setup;
mod view;
mod body;

pub use body::{Snow, Surroundings};
pub use material::{Law, Material, Plasticity, Preset};
pub use settings::{Blend, Integration, Kernel, SnowSettings, TimeStep, Transfer};
pub use setup::{SnowError, SnowObject, SnowSetup};
pub use view::{GridNode, ParticleState};

//! Snow: particles over a sparse grid, the material point method after Stomakhin et al. 2013.
//!
//! [`step()`] takes the stages in the paper's order; each is a file of `transfer`, whose formulas of the
//! material are in `law`.

mod settings;
mod law;
mod setup;
mod particles;
mod attached;
mod bound;
mod book;
mod model;
mod grid;
mod transfer;
mod ranks;
mod state;
mod step;
mod init;
mod body;
mod resultant;
mod view;
mod take;
mod placed;

pub use body::Snow;
pub use grid::{SIDE as BLOCK_SIDE, grid_bytes};
pub use law::{Law, Material, Plasticity, Preset, constitutive_scalar};
pub use model::SnowModel;
pub(crate) use placed::Place;
pub use settings::{Advection, Blend, Integration, Kernel, SnowSettings, Transfer};
pub use setup::{SnowError, SnowObject, SnowSetup};
pub use state::{SnowState, SnowWorkspace};
pub use step::{SnowStep, step};
pub(crate) use take::TakenSnow;
pub use transfer::weights;
pub use view::{GridNode, ParticleState};

#[cfg(test)]
mod tests;

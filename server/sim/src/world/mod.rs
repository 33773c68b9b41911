//! The world: gravity, wind, colliders and bodies on one clock.
//!
//! Reads a [`WorldSetup`] (binary64, the user's numbering); writes positions, reports, or the
//! reason why a step was not taken. [`Simulation`] is a world in a precision chosen at run time.

mod setup;
mod body;
mod calls;
mod clock;
mod change;
mod view;
mod simulation;
mod state;

pub use calls::changes::{Change, ChangeError, allowed};
pub use calls::collider_move::{ColliderMove, Departure, MoveError, MoveKey};
pub use calls::rules::ChangeRules;
pub use clock::World;
pub use clock::begin::{BeginError, Beginning};
pub use clock::carried::{Carried, CarriedError, Missing};
pub use setup::forces::{CalledForces, Forces, TimedForce};
pub use setup::parameters::{ClothParameters, SpringRange, WorldParameters};
pub use setup::pulls::{Pull, PullError};
pub use setup::topology::{BodyRole, BodyTopology, StepBound};
pub use setup::vectors::Vectors;
pub use setup::{BodySetup, SetupError, WorldSetup};
pub use simulation::Simulation;
pub use state::{StateError, TakenField, WorldState};

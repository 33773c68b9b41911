//! The world: gravity, wind, colliders and bodies on one clock.
//!
//! Reads a [`WorldSetup`] (binary64, the user's numbering); writes positions, reports, or the
//! reason why a step was not taken. [`Simulation`] is a world in a precision chosen at run time.

mod wind;
mod forces;
mod pulls;
mod vectors;
mod setup;
mod report;
mod topology;
mod parameters;
mod parts;
mod together;
mod cloth;
mod rest;
mod cloth_parameters;
mod cloth_fields;
mod placed;
mod snow;
mod body;
mod division;
mod pace;
mod cloths;
mod collider_move;
mod changes;
mod cloth_check;
mod apart;
mod ranges;
mod rules;
mod clock;
mod change;
mod carried;
mod begin;
mod view;
mod simulation;
mod state;

pub use begin::{BeginError, Beginning};
pub use carried::{Carried, CarriedError, Missing};
pub use changes::{Change, ChangeError, allowed};
pub use clock::World;
pub use collider_move::{ColliderMove, Departure, MoveError, MoveKey};
pub use forces::{CalledForces, Forces, TimedForce};
pub use parameters::{ClothParameters, SpringRange, WorldParameters};
pub use pulls::{Pull, PullError};
pub use rules::ChangeRules;
pub use setup::{BodySetup, SetupError, WorldSetup};
pub use simulation::Simulation;
pub use state::{StateError, TakenField, WorldState};
pub use topology::{BodyTopology, StepBound};
pub use vectors::Vectors;

//! What changes from step to step, and what steps tell of it: data without rules.
//!
//! Modules in reading order:

mod gain;
mod kept;
mod cloth;
mod turns;
mod report;

pub use cloth::{PathPoint, PinMotion, State};
pub(crate) use gain::Gain;
pub(crate) use kept::Kept;
pub(crate) use report::ClothReport;
pub(crate) use turns::Turns;

//! Steps of one cloth: sub-steps that are tried, judged, and taken or given up.
//!
//! Enters: a model, parameters, surroundings and a state. Leaves: the state one sub-step later, and what the step tells. Modules in
//! reading order:

mod attempt;
mod memory;
mod stepping;
mod meet;
mod long;
mod tasks;

pub(crate) use memory::StepMemory;
pub(crate) use stepping::Stepping;

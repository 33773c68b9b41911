//! What is known of a state: its forces, its energies, the matrix of an implicit step from it, and how long an explicit one may be.
//!
//! Enters: a model, numbers of a step, positions and velocities. Leaves: an evaluation, in memory of its own. Modules in reading order:

mod bound;
mod external;
mod numbers;
mod air;
mod figures;
mod spring_sums;
mod evaluation;
mod freeze;
mod step_matrix;
mod set_up;
mod moved;
mod iterate_sums;
mod led;
mod common;
mod energy;
mod evaluated;
mod coarse;
mod parts;

pub(super) use common::{Common, PartSums, Shift, Sums, kinetic_of, sums};
pub(super) use energy::{Allowance, Judged, Start};
pub(super) use evaluated::Evaluated;
pub(super) use evaluation::Evaluation;
pub(super) use external::symmetric;
pub(super) use figures::Total;
pub(super) use iterate_sums::{Leftover, SweepSums};
pub(super) use led::Led;
pub(super) use moved::{Motion, Moved, MovedSums, Weights};
pub(super) use numbers::StepNumbers;
pub(super) use set_up::SetUp;
pub(super) use spring_sums::SpringSums;
pub(super) use step_matrix::{StepMatrix, pattern};

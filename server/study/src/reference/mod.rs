//! What rows are compared with, and how far in time anything can be compared.
//!
//! Enters: a case. Leaves: its window, and states that are nearest to the truth. Modules in reading order:

mod window;
mod nearest;
mod halved;

pub(crate) use halved::{COST, F64_COST, MOST_WORK, halved};
pub use nearest::{NoReference, Reference, reference};
pub(crate) use window::OPEN;
pub use window::{DISPLACEMENT, SEED, Scan, scan};

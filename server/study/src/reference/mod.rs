//! What rows are compared with, and how far in time anything can be compared.
//!
//! Enters: a case, and a class of effort. Leaves: its window, and states that are nearest to the truth. Modules in reading order:

mod effort;
mod window;
mod nearest;
mod pace;
mod halved;

pub use effort::Effort;
pub(crate) use effort::OVERHEAD;
pub(crate) use halved::{COST, F64_COST, halved};
pub use nearest::{NoReference, Reference, reference};
pub(crate) use pace::{Chosen, chosen, chosen_of_snow};
pub use window::{DISPLACEMENT, SEED, Scan, scan};
pub(crate) use window::{OPEN, THICK, counted};

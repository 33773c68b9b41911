//! Where methods fail on a scene: the longest stable step of each at rest and under load, maps, and the same as the program
//! runs it.
//!
//! Enters: a case. Leaves: rows. Raw steps are taken whatever is known of them; a run under load is judged against a fine run
//! of the scene. Modules in reading order:

mod theory;
mod spectrum;
mod eigenvalues;
mod row;
mod cases;
mod expected;
mod modes;
mod ground;
mod probe;
mod bisect;
mod limit;
mod stepping;
mod map;
mod order;
mod study;

pub use bisect::longest_step;
pub use expected::Theory;
pub use map::Map;
pub use probe::WRONG;
pub use row::{Across, Over, StabilityRow, Stepping};
pub use spectrum::largest_frequency;
pub use study::{Stability, StabilityRequest, probe_at_rest, probe_under_load, stability};
pub use theory::{critical_step, critical_step_of_all};

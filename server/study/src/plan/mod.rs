//! The cheapest setting that is right enough for a scene.
//!
//! Enters: a case and a tolerance. Leaves: a setting as a scene can ask for it, verified until the predictability horizon
//! of the scene; or what it would take. A plan is a chart that looks only where it must. Modules in reading order:

mod candidate;
mod search;
mod verify;
mod terms;
mod answer;

pub use answer::{Needed, Plan, Tried, plan};
pub use candidate::Dropped;
pub use terms::{Removal, Term, without};
pub use verify::Verified;

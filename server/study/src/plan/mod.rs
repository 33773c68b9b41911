//! The cheapest setting that is accurate enough for a scene.
//!
//! Enters: a case, what its scene knows of its terms, and a tolerance. Leaves: a setting as a scene can ask for it, verified until the
//! predictability horizon of the scene and run to its end; or what it would take. A plan is a chart that looks only where it must. Modules
//! in reading order:

mod search;
mod verify;
mod reach;
mod terms;
mod rest;
mod answer;
mod of_cloth;
mod of_snow;
mod planned;

pub use answer::{Needed, Plan, Tried};
pub use planned::plan;
pub use reach::Reach;
pub use rest::Rested;
pub use terms::{SceneTerms, Term, Terms, Without};
pub use verify::Verified;

//! Terms of a scene: what can be removed from its text, springs, laws, drag, colliders, digits; of snow, how it yields.
//!
//! Enters: a scene. Leaves: its terms, or the scene without some of them. A field that is added to a scene does not compile here until
//! it is, or has, a term. Modules in reading order:

mod term;
mod cloth;
mod snow;
mod removed;

pub use term::{Removal, SceneTerm};

//! The particles of a cloth and what joins them, as its user numbers them.
//!
//! Enters: lists of a scene, and frames that lead figures. Leaves: the same with what can be told of them before they are laid out: what hangs together, what may
//! move at the same time, the solver that fits,
//! where its surface crosses itself, what is odd; and several of them as one. Modules in reading order:

mod continuations;
mod frames;
mod description;
mod joined;
mod thickness;
mod auto;
mod colours;
mod components;
mod warnings;

pub(crate) use auto::resolve;
pub(super) use colours::{Colours, Visit, spread};
pub(super) use components::{Components, Loose};
pub use description::{ElementList, Network, Spring, SpringKind, SpringLaw, SpringRules};
pub use frames::{FIRMNESS, Frames, Repeat};
pub(crate) use joined::Joined;
pub use thickness::Crossed;
pub(super) use warnings::{spacing, warnings};

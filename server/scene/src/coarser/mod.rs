//! A coarser copy of a scene: fewer particles for the same cloth, larger cells for the same snow.
//!
//! Enters: the text of a scene, and by how much it is to be coarser. Leaves: its text with other values in place of some; all else
//! stays, comments too. For cloth the numbers of the continuum are kept, of which the springs of a grid are a model. Modules in
//! reading order:

mod edits;
mod grid;
mod body;
mod snow;
mod copy;
#[cfg(test)]
mod tests;

pub use copy::{CoarserScene, coarser};
pub use grid::CoarserGrid;

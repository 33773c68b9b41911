//! Scenes in which programs of this kind fail, over every method. Its settings are those of a scene that says nothing of them.
//!
//! Enters: nothing. Leaves: tables of verdicts. Each file of scenes is a family: the step, the state, or what happens on the way is
//! what fails; a squeezed sheet; blocks of snow. Modules in reading order:

pub mod networks;
pub mod scene;
pub mod snow;
mod finding;
mod trial;
mod row;
mod steps;
mod states;
mod motions;
pub mod squeezed;
mod blocks;
mod pieces;
mod tables;

pub use finding::Finding;
pub use tables::{Exhibit, Family, Table, gallery};

//! Cloth that does not pass through cloth: pairs of parts of its surface that push each other in the linear solve, and a
//! certificate for each of them that they do not cross on their way.
//!
//! Enters: a model with a surface, a state, and where a solve leads. Leaves: what pairs add to the matrix and the right-hand side of
//! the next solve, or that the sub-step is safe. Nothing of it is state: each sub-step looks for pairs anew. Modules in reading order:

mod rules;
mod room;
mod friction;
mod place;
mod hold;
mod pair;
mod ways;
mod search;
mod certificate;
mod wall;
mod pushing;
mod rows;
mod limit;
mod groups;
mod book;
mod rounds;
mod count;

pub(super) use book::PairEnergy;
pub(super) use count::Count;
pub(super) use rounds::{Contact, ROUNDS, Review, Scene};
pub(super) use rows::PairRows;
pub use wall::wall_bytes;

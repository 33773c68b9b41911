//! Surfaces that may come close to themselves: which of their parts do, how far apart, what crosses.
//!
//! Pure geometry in binary64, about particles and triangles by number; no physics and no state but boxes that are made
//! anew. Two triangles come as close as a vertex of one and the other, or as an edge of one and an edge of the other.

#[cfg(test)]
mod numbers;
mod faces;
mod distance;
mod separation;
mod beside;
mod bounds;
mod search;
mod tree;
mod touching;
mod predicates;
mod crossings;

pub use beside::Beside;
pub use crossings::{Crossing, Crossings};
pub use distance::{Closest, Inside, PairKind, closest, edge_edge, vertex_triangle};
pub use faces::Faces;
pub use predicates::crosses;
pub(crate) use predicates::{comes_to, turn_above};
pub use separation::{between_middles, gap_along};
pub use touching::touching;
pub use tree::{Candidate, Tree, Unlisted, Wanted};

#[cfg(test)]
mod tests;
#[cfg(test)]
mod crowds;

//! Snow against closed forms and itself, where that takes long: waves, bending, impacts, and grids made finer.

mod animals;
mod bars;
mod beam;
mod torn_beam;
mod bounce;
mod clumps;
mod impact;
mod manufactured;
mod refinement;
mod thousand_clumps;

//! Numerics of cloth and snow: particles joined by springs, particles over a grid, advanced in time.
//!
//! Units are SI; axes are right-handed, y up. No clock, no file, no thread of its own: work is
//! divided over the rayon pool that the caller installs, and results have the same bits for any
//! number of threads. Modules in reading order:

mod bits;
mod names;
pub mod math;
pub mod interrupt;
pub mod parallel;
pub mod linalg;
pub mod report;
pub mod field;
pub mod mesh;
pub mod surface;
mod sub_step;
pub mod collide;
pub mod surroundings;
pub mod time_step;
mod held_length;
pub mod cloth;
pub mod snow;
pub mod world;

pub use bits::BITS;

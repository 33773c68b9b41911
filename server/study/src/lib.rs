//! Methods of cloth compared on a scene: how long the scene determines its answer, and error against cost.
//!
//! Reads a world as a scene builds it; writes rows, one per run. It brings the clock, and draws nothing. Work is divided
//! over the rayon pool that the caller installs; but for seconds, results are the same for any number of threads.
//! Modules in reading order:

mod method;

pub use method::{Method, NEWTON};

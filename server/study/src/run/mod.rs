//! One run of a case, within a budget of seconds.
//!
//! Enters: a case, how it is stepped, times. Leaves: states at these times, seconds, counts, and how it ended. Modules in reading
//! order:

mod budget;
mod end;
mod runner;

pub use budget::{Budget, Cut, Phase, Stop};
pub use end::{End, Failure, Verdict};
pub use runner::{Run, run};
pub(crate) use runner::{Runner, run_as_written, run_within};

//! Methods of cloth compared on a scene: how long the scene determines its answer, error against cost, where each method fails.
//!
//! Reads a world as a scene builds it; writes rows, one per run. It brings the clock, and draws nothing. Work is divided
//! over the rayon pool that the caller installs; but for seconds, results are the same for any number of threads.
//! Modules in reading order:

mod method;
mod scalar;
mod theory;
mod spectrum;
mod case;
mod times;
mod budget;
mod setting;
mod run;
mod window;
mod reference;
mod row;
mod front;
mod line;
mod request;
mod rows;
mod timing;
mod chart;
mod stability;
pub mod gallery;

pub use budget::{Budget, Phase, Stop};
pub use case::{Case, NoCloth};
pub use chart::{Chart, Limit, chart};
pub use front::cheapest;
pub use method::{Method, NEWTON};
pub use reference::{NoReference, Reference, reference};
pub use request::Request;
pub use row::{Outcome, Row};
pub use rows::line_names;
pub use run::{End, Failure, Run, run};
pub use scalar::ScalarLaw;
pub use setting::{Setting, Steps};
pub use spectrum::largest_frequency;
pub use stability::{
    Across, Fate, Map, Over, Stability, StabilityRequest, StabilityRow, Stepping, Theory, WRONG,
    longest_step, probe_at_rest, probe_under_load, stability,
};
pub use theory::{critical_step, critical_step_of_all};
pub use times::{Times, TimesError};
pub use window::{DISPLACEMENT, SEED, Scan, ScanEnd, scan};

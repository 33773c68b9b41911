//! Methods of cloth or snow compared on a scene: the predictability horizon of the scene, error against cost, where each method fails.
//!
//! Reads a world as a scene builds it; writes rows, one per run. It brings the clock, and draws nothing. Work is divided
//! over the rayon pool that the caller installs; but for seconds, results are the same for any number of threads.
//! Modules in reading order:

pub mod quantity;
mod method;
mod variant;
mod scalar;
mod theory;
mod spectrum;
mod eigenvalues;
mod case;
mod times;
mod budget;
mod setting;
mod split;
mod snow;
mod stepped;
mod run;
mod window;
mod reference;
mod halved;
mod row;
mod front;
mod line;
mod request;
mod rows;
mod timing;
mod chart;
mod snow_chart;
mod compare;
pub mod profile;
mod plan;
mod stability;
pub mod gallery;

pub use budget::{Budget, Cut, Phase, Stop};
pub use case::{Case, NothingToStudy};
pub use chart::{Chart, Limit};
pub use compare::{chart, line_names};
pub use front::cheapest;
pub use method::{Method, NEWTON};
pub use plan::{
    Dropped, Needed, Plan, Reach, ReachEnd, SceneTerms, Term, Terms, Tried, Verified, Without, plan,
};
pub use reference::{NoReference, Reference, reference};
pub use request::Request;
pub use row::{Outcome, Row};
pub use run::{End, Failure, Run, run};
pub use scalar::ScalarLaw;
pub use setting::{Setting, Steps};
pub use snow::{SnowSetting, SnowSteps};
pub use spectrum::largest_frequency;
pub use split::{CHILDREN, parents, split};
pub use stability::{
    Across, Fate, Map, Over, Stability, StabilityRequest, StabilityRow, Stepping, Theory, WRONG,
    longest_step, probe_at_rest, probe_under_load, stability,
};
pub use stepped::Stepped;
pub use theory::{critical_step, critical_step_of_all};
pub use times::{Times, TimesError};
pub use variant::Variant;
pub use window::{DISPLACEMENT, SEED, Scan, ScanEnd, scan};

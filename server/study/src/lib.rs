//! Methods of cloth or snow compared on a scene.
//!
//! A study takes a scene as it is written: its [`Case`]. It steps it in every way that the program has: each a [`Setting`] of cloth or
//! a [`SnowSetting`] of snow. It compares each [`run()`] with a [`Reference`], which is nearest to the truth, up to the predictability
//! horizon of the scene, which [`scan`] finds. What it leaves is a row per run:
//!
//! - [`chart()`]: error against cost;
//! - [`plan()`]: the cheapest setting that is accurate enough, and what the scene can do without;
//! - [`stability()`]: the longest step that each method takes, and maps of it;
//! - [`gallery`]: scenes in which programs of this kind fail.
//!
//! It brings the clock, and draws nothing. Work is divided over the rayon pool that the caller installs; but for seconds, and for what
//! a budget cuts, results are the same for any number of threads. Modules in reading order:

pub mod quantity;
mod case;
mod method;
mod run;
mod reference;
mod chart;
mod plan;
mod stability;
pub mod gallery;

pub use case::{Case, CommonPoints, Measure, NoMeasure, NothingToStudy, Times, TimesError};
pub use chart::{
    Chart, Coarser, CoarserRows, Dropped, Limit, Request, Row, add_coarser, chart, cheapest, line_names,
    profile,
};
pub use method::{
    CHILDREN, Method, NEWTON, Setting, SnowSetting, SnowSteps, Stepped, Steps, Variant, parents, split,
};
pub use plan::{Needed, Plan, Reach, Rested, SceneTerms, Term, Terms, Tried, Verified, Without, plan};
pub use reference::{DISPLACEMENT, Effort, NoReference, Reference, SEED, Scan, reference, scan};
pub use run::{Budget, Cut, End, Failure, Phase, Run, Stop, Verdict, run};
pub use stability::{
    Across, Map, Over, Stability, StabilityRequest, StabilityRow, Stepping, Theory, WRONG, critical_step,
    critical_step_of_all, largest_frequency, longest_step, probe_at_rest, probe_under_load, stability,
};

//! Whether what a step led to may stand.
//!
//! Enters: evaluations before and after. Leaves: what energy is allowed and owed, or why the step is not accepted. Modules in reading
//! order:

mod rounding;
mod energies;
mod limits;
mod bounding;
mod contact_gain;
mod gain;
mod accept;

pub(super) use accept::{After, Before, Found, accept, falls_short, moving};
pub(crate) use bounding::bounding_law;
pub(super) use contact_gain::{most_owed, owed};
pub(super) use energies::risen_most;
pub(super) use gain::{gain_limit, gained, start_of};
pub(super) use limits::{cause, fastest, judge};
pub(super) use rounding::rounding;

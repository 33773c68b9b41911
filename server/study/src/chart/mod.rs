//! Error against cost: rows of every method on a scene, each at ever shorter steps or smaller cells.
//!
//! Enters: a case and a request. Leaves: a chart. Modules in reading order:

mod row;
mod front;
mod line;
mod request;
mod search;
mod rows;
pub(crate) mod timing;
mod of_cloth;
pub(crate) mod of_snow;
mod coarser;
mod compare;
pub mod profile;

pub use coarser::{Coarser, add_coarser};
pub use compare::{chart, line_names};
pub use front::cheapest;
pub use line::Dropped;
pub(crate) use line::{Line, Tries, lines};
pub use of_cloth::{Chart, CoarserRows, Limit};
pub(crate) use of_cloth::{Kept, without_rows};
pub(crate) use of_snow::CUBIC;
pub use request::Request;
pub use row::Row;
pub(crate) use row::median_seconds;
pub(crate) use search::{Rule, Search};

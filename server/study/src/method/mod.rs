//! How a case can be stepped: methods of cloth and of snow, with their steps or cells, and a precision.
//!
//! Enters: a case. Leaves: the setup of a world that steps it so. Modules in reading order:

mod of_cloth;
mod of_snow;
mod setting;
mod split;
mod snow_setting;
mod stepped;

pub use of_cloth::{Method, NEWTON};
pub use of_snow::Variant;
pub(crate) use setting::Plan;
pub use setting::{Setting, Steps};
pub(crate) use snow_setting::variants;
pub use snow_setting::{SnowSetting, SnowSteps};
pub use split::{CHILDREN, parents, split};
pub use stepped::Stepped;

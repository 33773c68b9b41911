//! Methods compared on a scene, of cloth or of snow.

use super::{
    of_cloth::{Chart, of_cloth},
    of_snow::{self, of_snow},
    request::Request,
    rows,
};
use crate::{case::Case, run::Budget};

/// Charts a case. `tell` is called with what is done now.
pub fn chart(case: &Case, request: &Request, budget: &Budget, tell: &dyn Fn(&str)) -> Chart {
    match &case.setup.snow {
        Some(snow) => of_snow(case, snow, request, budget, tell),
        None => of_cloth(case, request, budget, tell),
    }
}

/// Names of all lines of a chart of a case, in their order.
pub fn line_names(case: &Case) -> Vec<String> {
    case.setup.snow.as_ref().map_or_else(rows::line_names, of_snow::names)
}

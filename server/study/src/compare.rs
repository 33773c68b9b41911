//! Methods compared on a scene, of cloth or of snow.

use crate::{
    budget::Budget,
    case::Case,
    chart::{Chart, of_cloth},
    request::Request,
    rows,
    snow_chart::{self, of_snow},
};

/// Charts a case. `tell` is called with what is done now.
pub fn chart(case: &Case, request: &Request, budget: &Budget, tell: &dyn Fn(&str)) -> Chart {
    match &case.setup.snow {
        Some(snow) => of_snow(case, snow, request, budget, tell),
        None => of_cloth(case, request, budget, tell),
    }
}

/// Names of all lines of a chart of a case, in their order.
pub fn line_names(case: &Case) -> Vec<String> {
    case.setup.snow.as_ref().map_or_else(rows::line_names, snow_chart::names)
}

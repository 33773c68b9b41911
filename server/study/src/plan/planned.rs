//! The plan of a case, of cloth or of snow, and what of it keeps up with real time.

use super::{
    answer::{Plan, most_accurate},
    of_cloth::of_cloth,
    of_snow::of_snow,
    terms::SceneTerms,
};
use crate::{
    case::Case,
    chart::{Request, Row, of_snow},
    run::Budget,
};

/// Seconds per simulated second of what keeps up with real time.
const REAL_TIME: f64 = 1.0;

/// Plans a case, whose scene has these terms. `tell` is called with what is done now.
pub fn plan(
    case: &Case,
    request: &Request,
    scene: &SceneTerms<'_>,
    budget: &Budget,
    tell: &dyn Fn(&str),
) -> Plan {
    let mut plan = match &case.setup.snow {
        Some(snow) => {
            let chart = of_snow::of_snow(case, snow, request, budget, tell);
            of_snow(case, chart, request, scene, budget, tell)
        }
        None => of_cloth(case, request, scene, budget, tell),
    };
    let keeps_up = |row: &Row| row.seconds.is_some_and(|seconds| seconds <= REAL_TIME);
    plan.real_time = most_accurate(&plan.chart.rows, plan.chart.floor, keeps_up);
    plan.chart.is_stopped = budget.is_stopped();
    plan
}

//! The plan of a scene of cloth: a search, what it finds verified and run to the end of the scene, and the terms of that.

use super::{
    answer::{Plan, Tried, most_accurate},
    reach::Sought,
    rest::rested,
    search::{right, search},
    terms::{Looked, Recommended, SceneTerms, terms},
    verify::{Verification, quicker},
};
use crate::{
    case::Case,
    chart::{Dropped, Kept, Line, Request, Row, Search, without_rows},
    run::{Budget, Phase, run},
};

/// Shares of the budget at whose end each part is over, after the reference.
const SEARCH: f64 = 0.60;
const VERIFIED: f64 = 0.76;
const REACHED: f64 = 0.84;
const TIMED: f64 = 0.88;
const TERMS: f64 = 0.98;

/// Plans the cloths of a case. `tell` is called with what is done now.
pub(super) fn of_cloth(
    case: &Case,
    request: &Request,
    scene: &SceneTerms<'_>,
    budget: &Budget,
    tell: &dyn Fn(&str),
) -> Plan {
    let mut chart = without_rows(case, request, Kept::EveryStep, budget, tell);
    let Some(reference) = chart.reference.clone() else { return Plan::nothing(chart) };
    let against = (&reference, chart.scan.bound);
    let Some(mut search) = search(case, request, against, &budget.until(SEARCH), tell) else {
        return Plan::nothing(chart);
    };
    let places = right(&search);
    let steps = steps(case, request, search.times.end());
    let mut verification = Verification { search: &search, rows: Vec::new() };
    let mut verify = |place: usize, phase: &Phase| verification.verified(search.rows[place].clone(), phase);
    // Of half the step it is enough that its error is known.
    let allowed = [search.tolerance, f64::INFINITY];
    let within = (budget, [VERIFIED, REACHED]);
    let mut sought = Sought::of((case, steps), &places, allowed, &mut verify, within, tell);
    let mut verifying = verification.rows;
    let quicker = sought.found.as_mut().and_then(|found| {
        tell("timing the cheapest in turn");
        let phase = budget.until(TIMED);
        quicker((case, &search.times), &mut found.row, &mut search.rows, &places, &phase)
    });
    let recommended = sought.met().map(|found| {
        let (times, places, tolerance) = (&search.times, &search.places[..], search.tolerance);
        Recommended { case, found, reference: &reference, times, places, tolerance, steps }
    });
    let phase = budget.until(TERMS);
    let looked = recommended
        .as_ref()
        .map_or_else(Looked::default, |recommended| terms(recommended, scene, &phase, tell));
    let rested = recommended.as_ref().and_then(|recommended| rested(recommended, &phase, tell));
    let (rows, tried) = sorted(&search);
    chart.is_cut |= tried.iter().any(|one| one.dropped == Some(Dropped::Time));
    let searched = rows.len();
    chart.rows = rows;
    chart.rows.append(&mut verifying);
    let plan = Plan::of(chart, sought, looked, most_accurate(&search.rows, 0.0, |_| true));
    let met_until = plan.row.as_ref().map_or(0.0, |row| met_until(&search, row, &budget.until(1.0)));
    let met_until = plan.reach.as_ref().map_or(met_until, |reach| met_until.min(reach.until));
    Plan { searched, tried, quicker, met_until, rested, ..plan }
}

/// The steps of a scene in its window, until a time (s), and until its end: that which was asked for where it has none.
pub(super) fn steps(case: &Case, request: &Request, until: f64) -> [u64; 2] {
    let window = (until / case.dt()).round() as u64;
    let scene = match request.scene_steps {
        0 => (request.end / case.dt() + 1e-6) as u64,
        steps => steps,
    };
    [window, scene.max(window)]
}

/// Rows in the order of their lines, and what became of these.
fn sorted(search: &Search<'_>) -> (Vec<Row>, Vec<Tried>) {
    let order = search.order();
    let tried = |line: &Line| Tried {
        name: line.name(),
        precision: line.precision,
        // How far one came that was cut is a matter of time.
        row: order.iter().position(|place| line.row == Some(*place) && line.dropped != Some(Dropped::Time)),
        dropped: line.dropped,
    };
    let tried = search.lines.iter().map(tried).collect();
    (order.iter().map(|place| search.rows[*place].clone()).collect(), tried)
}

/// Until when (s) a row meets the tolerance: to the end where its error does.
fn met_until(search: &Search<'_>, row: &Row, phase: &Phase) -> f64 {
    if row.error().is_some_and(|error| error <= search.tolerance) {
        return search.times.end();
    }
    let made = run(search.case, row.stepped, &search.times, phase);
    let pairs = made.states.iter().zip(&search.places);
    let errors = pairs.map(|(found, place)| search.case.distance(found, &search.reference.states[*place]));
    let count = errors.take_while(|error| *error <= search.tolerance).count();
    search.times.marks[..count].last().map_or(0.0, |mark| search.times.time(*mark))
}

//! The plan of a scene of cloth: a search, what it finds verified and run to the end of the scene, and the terms of that.

use super::{
    answer::{Plan, Sought, Tried, most_accurate},
    candidate::{Candidate, Dropped},
    reach::{Found, ReachEnd, reach},
    search::Search,
    terms::{Looked, Recommended, SceneTerms, terms},
    verify::{quicker, verified},
};
use crate::{
    case::Case,
    chart::{Kept, Request, Row, without_rows},
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
    let mut search = Search::new(case, request, &reference, chart.scan.bound);
    if search.times.count() == 0 {
        return Plan::nothing(chart);
    }
    search.go(&budget.until(SEARCH), tell);
    let steps = steps(case, request, search.times.end());
    let mut sought = find(&mut search, steps, budget, tell);
    let quicker = sought.found.as_mut().and_then(|found| {
        tell("timing the cheapest in turn");
        let places = search.right();
        let phase = budget.until(TIMED);
        quicker((case, &search.times), &mut found.row, &mut search.rows, &places, &phase)
    });
    let looked = sought.met().map_or_else(Looked::default, |found| {
        terms(&recommended(&search, found, steps), scene, &budget.until(TERMS), tell)
    });
    let (rows, tried) = sorted(&search);
    chart.is_cut |= tried.iter().any(|one| one.dropped == Some(Dropped::Time));
    let searched = rows.len();
    chart.rows = rows;
    chart.rows.append(&mut search.verification);
    let plan = Plan::of(chart, sought, looked, most_accurate(&search.rows, 0.0, |_| true));
    let met_until = plan.row.as_ref().map_or(0.0, |row| met_until(&search, row, &budget.until(1.0)));
    let met_until = plan.reach.as_ref().map_or(met_until, |reach| met_until.min(reach.until));
    Plan { searched, tried, quicker, met_until, ..plan }
}

/// What is recommended, for a look at its terms.
fn recommended<'a>(search: &'a Search<'_>, found: &'a Found, steps: [u64; 2]) -> Recommended<'a> {
    Recommended {
        case: search.case,
        stepped: found.row.stepped,
        reference: search.reference,
        times: &search.times,
        places: &search.places,
        error: found.verified.error,
        tolerance: search.tolerance,
        steps,
        reach: &found.reach,
    }
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

/// The cheapest of what is right enough that is right enough by half its step too, and comes to the end of the scene; where none does,
/// the one that comes furthest. Beside it the cheapest that there was no time to verify.
fn find(search: &mut Search<'_>, steps: [u64; 2], budget: &Budget, tell: &dyn Fn(&str)) -> Sought {
    let (verifying, reaching) = (budget.until(VERIFIED), budget.until(REACHED));
    let mut sought = Sought { found: None, unverified: None, steps };
    for place in search.right() {
        tell("verifying the cheapest with half its step");
        let row = search.rows[place].clone();
        let (row, verified) = verified(search, row, &verifying);
        // An error that was small by chance may be large with half the step.
        if verified.error > search.tolerance {
            continue;
        }
        if verified.is_cut {
            sought.unverified = Some((row, verified));
            break;
        }
        if verified.half_step_error.is_none() {
            continue;
        }
        tell("running the cheapest to the end of the scene");
        let reach = reach(search.case, row.stepped, steps, &reaching);
        let is_last = !matches!(reach.end, ReachEnd::Failed(_));
        sought.found = Some(Found::further(sought.found.take(), Found { row, verified, reach }));
        if is_last {
            break;
        }
    }
    sought
}

/// Rows in the order of their candidates, and what became of these.
fn sorted(search: &Search<'_>) -> (Vec<Row>, Vec<Tried>) {
    let of_row = |row: &Row| {
        let is_its =
            |one: &Candidate| (one.name(), one.precision()) == (row.stepped.name(), row.stepped.precision());
        search.candidates.iter().position(is_its)
    };
    let mut order: Vec<usize> = (0..search.rows.len()).collect();
    order.sort_by_key(|place| of_row(&search.rows[*place]));
    let tried = search.candidates.iter().map(|one| Tried {
        name: one.name(),
        precision: one.precision(),
        // How far one came that was cut is a matter of time.
        row: order.iter().position(|place| one.row == Some(*place) && one.dropped != Some(Dropped::Time)),
        dropped: one.dropped,
    });
    let tried = tried.collect();
    (order.iter().map(|place| search.rows[*place].clone()).collect(), tried)
}

/// Until when (s) a row meets the tolerance: to the end where its error does.
fn met_until(search: &Search<'_>, row: &Row, phase: &Phase) -> f64 {
    if row.error().is_some_and(|error| error <= search.tolerance) {
        return search.times.end();
    }
    let made = run(search.case, row.stepped, &search.times, phase);
    let pairs = made.states.iter().zip(&search.places);
    let errors = pairs.map(|(found, place)| search.case.rms(found, &search.reference.states[*place]));
    let count = errors.take_while(|error| *error <= search.tolerance).count();
    search.times.marks[..count].last().map_or(0.0, |mark| search.times.time(*mark))
}

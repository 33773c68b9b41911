//! A plan in words: what to do, and what was tried.

use nappe_study::{Dropped, End, Limit, Measure, Plan, Row, Term, Tried};

use crate::{
    studies::{
        chart::words::{known, limit, steps},
        study::CoarserCopy,
    },
    words::output::{Column, length, moment, several, table, time},
};

/// A method in steps.
fn setting(row: &Row) -> String {
    format!("{} in {} with steps of {}", row.stepped.name(), row.stepped.precision(), steps(row))
}

fn cost(row: &Row) -> String {
    row.seconds.map_or_else(String::new, |seconds| format!(" for {} per simulated second", time(seconds)))
}

/// A paragraph that a person can act on.
pub(crate) fn answer(plan: &Plan) -> String {
    let Some(row) = &plan.row else {
        return [Some(nothing(plan)), offer(plan)].into_iter().flatten().collect::<Vec<_>>().join(" ");
    };
    let parts = [
        Some(first(plan, row)),
        verified(plan),
        reach(plan),
        reduced(plan),
        quicker(plan),
        rested(plan),
        needed(plan, row),
        real_time(plan),
        cut(plan),
        known(&plan.chart),
        Some(limit(&plan.chart)),
        Some(promise(plan).to_owned()),
        offer(plan),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" ")
}

/// What it does not promise.
fn promise(plan: &Plan) -> &'static str {
    match plan.chart.measure {
        Measure::Motion => "A plan promises nothing after that.",
        Measure::End | Measure::Energy | Measure::Sag | Measure::Coordinate { .. } => {
            "A plan promises nothing of what it did not compare."
        }
    }
}

/// What can be planned of the whole scene, where its motion cannot.
fn offer(plan: &Plan) -> Option<String> {
    let chart = &plan.chart;
    let is_short = matches!(chart.limit, Limit::Spread | Limit::Reference | Limit::Work) && !chart.is_whole();
    let is_beyond = is_short && chart.measure == Measure::Motion && chart.missing.is_none();
    is_beyond.then(|| {
        format!(
            "Where a scene comes to rest, its end may be known although its motion is not: the same with --measure end plans that over \
             the whole scene, {}.",
            moment(chart.end)
        )
    })
}

/// Why nothing was tried.
fn nothing(plan: &Plan) -> String {
    let chart = &plan.chart;
    if chart.measure != Measure::Motion {
        return limit(chart);
    }
    let within = chart.scan.spread.iter().take_while(|spread| **spread <= 0.25 * chart.tolerance).count();
    if chart.reference.is_some() || chart.missing.is_some() || within == 0 {
        return limit(chart);
    }
    if let Some(own) = chart.whole.as_ref().and_then(|whole| whole.own_error.first()) {
        return format!(
            "Nothing can be compared: after the first step of the scene the reference is known to {}, more than {}, a quarter of \
             the tolerance. Allow a larger --tolerance.",
            length(*own),
            length(0.25 * chart.tolerance)
        );
    }
    format!(
        "Nothing can be compared: the predictability horizon to {} lies within the first step of the scene, after {}. Give the \
         scene a shorter dt, or allow a larger --tolerance.",
        length(chart.tolerance),
        time(within as f64 * chart.scan.spacing)
    )
}

/// What is recommended, or else the nearest.
fn first(plan: &Plan, row: &Row) -> String {
    let (tolerance, compared) = (length(plan.chart.tolerance), plan.chart.compared());
    let error = row.error().map_or_else(|| "unknown".to_owned(), length);
    let (setting, cost) = (setting(row), cost(row));
    if plan.is_met && plan.chart.is_whole() {
        format!("Take {setting}: it is {error} off {compared}, within {tolerance},{cost}.")
    } else if plan.is_met {
        format!("Only {compared}: {setting} is {error} off, within {tolerance},{cost}.")
    } else if plan.verified.is_some() {
        format!(
            "Nothing is recommended. The cheapest within {tolerance} {compared} is {setting}: {error} off,{cost}."
        )
    } else {
        let within = if row.error().is_some_and(|error| error <= plan.chart.tolerance) {
            format!("0.7 of {tolerance}, which a plan asks of what it tries,")
        } else {
            tolerance
        };
        format!(
            "Nothing that was tried is within {within} {compared}. The nearest is {setting}: {error} off,{cost}."
        )
    }
}

/// What half the step shows.
fn verified(plan: &Plan) -> Option<String> {
    let (verified, row) = (plan.verified?, plan.row.as_ref()?);
    let Some(half) = verified.half_step_error else {
        let what = "It is not verified with half the step: out of time; a larger --budget verifies it.";
        return verified.is_cut.then(|| what.to_owned());
    };
    let half = length(half);
    let order = verified.order.map(|order| format!("order {order:.1}"));
    Some(match (order, verified.is_asymptotic, row.stepped.cell()) {
        (Some(order), true, None) => {
            format!("With half the step it is {half} off, {order}, as it should.")
        }
        (Some(order), false, None) => format!(
            "With half the step it is {half} off, {order}: not yet as its order says, so that its error is less certain."
        ),
        _ => format!("With half the step it is {half} off."),
    })
}

/// How far it runs as a scene.
fn reach(plan: &Plan) -> Option<String> {
    let reach = plan.reach.as_ref()?;
    let (steps, until) = (several(reach.steps, "step"), moment(reach.until));
    Some(match &reach.end {
        End::Reached => format!("The scene was run so to its end, {until}."),
        End::Failed(failure) => {
            let cause = &failure.cause;
            format!("The scene may be run so until {until}, {steps}: the next one fails, {cause}.")
        }
        End::Cut(_) | End::Costly => {
            format!("The scene may be run so until {until}, {steps}: not run beyond it: out of time.")
        }
    })
}

/// What becomes of it without what can go.
fn reduced(plan: &Plan) -> Option<String> {
    let reduced = plan.reduced.as_ref()?;
    let error = reduced.error().map_or_else(|| "unknown".to_owned(), length);
    let is_copy = |term: &&Term| term.is_left_out && CoarserCopy::is_term(term);
    let copy = plan.terms.iter().find(is_copy).map_or_else(String::new, |term| {
        format!("The scene that is written is a coarser copy, {}. ", term.name)
    });
    Some(format!("{copy}Without what is left out it is {error} off,{}.", cost(reduced)))
}

/// What took less time here.
fn quicker(plan: &Plan) -> Option<String> {
    let quicker = plan.quicker.as_ref()?;
    let seconds = time(quicker.seconds?);
    Some(format!("Here {} took less: {seconds} per simulated second.", setting(quicker)))
}

/// What it saves if what lies still sleeps, where something did.
fn rested(plan: &Plan) -> Option<String> {
    let rested = plan.rested.filter(|rested| rested.told > 0.0 || rested.saved_counts > 0.0)?;
    Some(format!(
        "With rest = {{ error = {:.3e} }} it takes {:.0} % fewer evaluations and products: it is told to be {} off, and is {}.",
        rested.error,
        100.0 * rested.saved_counts,
        length(rested.told),
        length(rested.measured)
    ))
}

/// What it would take, and until when it is accurate enough as it is.
fn needed(plan: &Plan, row: &Row) -> Option<String> {
    let tolerance = length(plan.chart.tolerance);
    let far = row.error().is_some_and(|error| error > plan.chart.tolerance);
    let what = match plan.needed {
        Some(needed) => {
            let what = needed.cell.map_or_else(
                || format!("steps of {}", time(needed.dt)),
                |cell| format!("cells of {}", length(cell)),
            );
            format!("It would take {what}, about {} per simulated second.", time(needed.seconds))
        }
        None if plan.verified.is_none() && far && !plan.chart.is_cut => {
            let what = if row.stepped.cell().is_some() { "small cells" } else { "short steps" };
            format!("How {what} must be cannot be told from what was run: more than four halvings away.")
        }
        None => return None,
    };
    if plan.met_until > 0.0 {
        Some(format!("{what} Until {} it is within {tolerance}.", moment(plan.met_until)))
    } else {
        Some(what)
    }
}

/// What keeps up with real time, where nothing is accurate enough.
fn real_time(plan: &Plan) -> Option<String> {
    let row = plan.real_time.as_ref().filter(|_| !plan.is_met)?;
    let error = row.error().map_or_else(String::new, length);
    Some(format!("Of what keeps up with real time {} is the nearest, {error} off.", setting(row)))
}

/// How many methods were given up for want of time.
fn cut(plan: &Plan) -> Option<String> {
    let what = match plan.cut_count() {
        0 => return None,
        1 => "1 method was".to_owned(),
        count => format!("{count} methods were"),
    };
    Some(format!("{what} not looked at to the end: out of time, so that a cheaper one may exist."))
}

/// Every method with its best row, and why it was given up; those that cost more than the cheapest in one line.
pub(crate) fn tried(plan: &Plan) -> String {
    let row = |one: &Tried| {
        let row = one.row.and_then(|place| plan.chart.rows.get(place));
        vec![
            format!("{} {}", one.name, one.precision),
            row.map(|row| time(row.dt)).unwrap_or_default(),
            row.and_then(Row::error).map(length).unwrap_or_default(),
            row.and_then(|row| row.seconds).map(|seconds| format!("{seconds:.3}")).unwrap_or_default(),
            one.dropped.map_or("right", |dropped| dropped.why()).to_owned(),
        ]
    };
    let columns = [
        Column::Left("method"),
        Column::Right("step"),
        Column::Right("rms error"),
        Column::Right("s per simulated s"),
        Column::Left("ended because"),
    ];
    let (costly, others): (Vec<&Tried>, Vec<&Tried>) =
        plan.tried.iter().partition(|one| one.dropped == Some(Dropped::Costly));
    let table = table(&columns, &others.into_iter().map(row).collect::<Vec<_>>());
    match costly.len() {
        0 => table,
        1 => format!("{table}\n1 other costs more than the cheapest."),
        count => format!("{table}\n{count} others cost more than the cheapest."),
    }
}

//! A plan in words: what to do, and what was tried.

use nappe_study::{Plan, Row, Term, Tried};

use crate::{
    chart::words::{length, limit},
    output::{Column, table},
};

/// A time (s) in the unit that suits it, with three digits that count.
fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s >= 7200.0 => (s / 3600.0, "h"),
        s if s >= 120.0 => (s / 60.0, "min"),
        s if s >= 1.0 => (s, "s"),
        s if s >= 1e-3 => (s * 1e3, "ms"),
        s => (s * 1e6, "us"),
    };
    let digits = (2 - value.abs().max(1e-3).log10().floor() as i32).clamp(0, 4) as usize;
    format!("{value:.digits$} {unit}")
}

/// A method in steps.
fn setting(row: &Row) -> String {
    let of = format!("{} in {}", row.stepped.name(), row.stepped.precision());
    let steps = match (row.stepped.step_tolerance(), row.stepped.cell()) {
        (Some(tolerance), _) => {
            format!("with steps of {} on average, {} per step", time(row.dt), length(tolerance))
        }
        (_, Some(cell)) => format!("with steps of {} on average, cells of {}", time(row.dt), length(cell)),
        (None, None) => format!("with steps of {}", time(row.dt)),
    };
    format!("{of} {steps}")
}

fn cost(row: &Row) -> String {
    row.seconds.map_or_else(String::new, |seconds| format!(" for {} per simulated second", time(seconds)))
}

/// A paragraph that a person can act on.
pub(crate) fn answer(plan: &Plan) -> String {
    let tolerance = length(plan.chart.tolerance);
    let Some(row) = &plan.row else { return limit(&plan.chart) };
    let until = format!("{:.3} s", plan.chart.until());
    let error = row.error().map_or_else(|| "unknown".to_owned(), length);
    let mut text = if plan.is_met {
        format!("Take {}: it is {error} off until {until}, within {tolerance},{}.", setting(row), cost(row))
    } else {
        format!(
            "Nothing that was tried is within {tolerance} until {until}. The nearest is {}: {error} off,{}.",
            setting(row),
            cost(row)
        )
    };
    text.push_str(&verified(plan));
    if let Some(needed) = plan.needed {
        let what = needed.cell.map_or_else(
            || format!("steps of {}", time(needed.dt)),
            |cell| format!("cells of {}", length(cell)),
        );
        text = format!("{text} It would take {what}, about {} per simulated second.", time(needed.seconds));
        if plan.met_until > 0.0 {
            text = format!("{text} Until {:.3} s it is within {tolerance}.", plan.met_until);
        }
    }
    if let (false, Some(real_time)) = (plan.is_met, &plan.real_time) {
        let error = real_time.error().map_or_else(String::new, length);
        text = format!(
            "{text} Of what keeps up with real time {} is the nearest, {error} off.",
            setting(real_time)
        );
    }
    format!("{text} {} A plan promises nothing after that.", limit(&plan.chart))
}

/// What half the step shows.
fn verified(plan: &Plan) -> String {
    let Some((verified, half)) =
        plan.verified.and_then(|verified| Some((verified, verified.half_step_error?)))
    else {
        return String::new();
    };
    let order = verified.order.map_or_else(String::new, |order| format!(", order {order:.1}"));
    if verified.is_asymptotic {
        format!(" With half the step it is {} off{order}, as it should.", length(half))
    } else {
        format!(
            " With half the step it is {} off{order}: not yet as its order says, so that its error is less certain.",
            length(half)
        )
    }
}

/// Every method with its best row, and why it was given up.
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
    table(&columns, &plan.tried.iter().map(row).collect::<Vec<_>>())
}

/// What the scene can do without, as a table and a sentence; nothing where no term was looked at.
pub(crate) fn terms(plan: &Plan) -> String {
    if plan.terms.is_empty() {
        return String::new();
    }
    let row = |term: &Term| {
        let what = match (term.is_left_out, term.is_needed) {
            (true, _) => "can go",
            (false, true) => "needed",
            (false, false) => "small, but not with the others",
        };
        vec![
            term.name.clone(),
            term.change.map_or_else(|| "fails".to_owned(), moved),
            format!("{:.0} %", 100.0 * term.saving),
            what.to_owned(),
        ]
    };
    let columns = [
        Column::Left("without"),
        Column::Right("the answer moves by"),
        Column::Right("time saved"),
        Column::Left("so it"),
    ];
    let table = table(&columns, &plan.terms.iter().map(row).collect::<Vec<_>>());
    let names: Vec<&str> =
        plan.terms.iter().filter(|term| term.is_left_out).map(|term| term.name.as_str()).collect();
    let tolerance = length(plan.chart.tolerance);
    let sentence = if names.is_empty() {
        format!("Every term moves the answer by more than the {tolerance} that are allowed leave.")
    } else {
        format!("Together these can go, and the answer stays within {tolerance}: {}.", names.join(", "))
    };
    format!("{table}\n\n{sentence}")
}

/// How far an answer moves (m).
fn moved(change: f64) -> String {
    if change == 0.0 { "0".to_owned() } else { length(change) }
}

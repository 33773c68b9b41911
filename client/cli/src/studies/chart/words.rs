//! A chart in words: what is cheapest to some errors, and what limits the time in which runs are compared.

use nappe_study::{Chart, Effort, Limit, Measure, NoReference, Row, cheapest};

use crate::words::output::{Column, length, moment, several, table, three, time};

/// Errors (m) to which the cheapest row is told.
const ERRORS: [f64; 3] = [1e-2, 1e-3, 1e-4];

/// What steps a row makes.
pub(crate) fn steps(row: &Row) -> String {
    let mean = time(row.dt);
    match (row.stepped.step_tolerance(), row.stepped.cell()) {
        (Some(tolerance), _) => format!("{mean} on average, {} per step", length(tolerance)),
        (_, Some(cell)) => format!("{mean} on average, cells of {}", length(cell)),
        (None, None) => mean,
    }
}

/// What is known of the error of a row.
fn error(row: &Row) -> String {
    match row.at_most {
        Some(most) => format!("at most {}", length(most)),
        None => row.error().map_or_else(String::new, length),
    }
}

/// The table at the end.
pub(crate) fn cheapest_rows(chart: &Chart) -> String {
    let row = |name: String, row: Option<&Row>| {
        let Some(row) = row else {
            return [name, "none".to_owned(), String::new(), String::new(), String::new()].to_vec();
        };
        let seconds = row.seconds.map_or_else(String::new, |seconds| format!("{seconds:.3}"));
        let method = format!("{} {}", row.stepped.name(), row.stepped.precision());
        [name, method, steps(row), error(row), seconds].to_vec()
    };
    let mut rows: Vec<_> =
        ERRORS.iter().map(|error| row(length(*error), cheapest(&chart.rows, *error))).collect();
    let own = chart.rows.iter().find(|row| row.own);
    rows.extend(own.map(|own| {
        if own.error().is_some() {
            return row("as written".to_owned(), Some(own));
        }
        let cause = own.end.failure().map_or("it was stopped", |failure| &failure.cause);
        ["as written", &own.stepped.name(), own.end.name(), cause, ""].map(str::to_owned).to_vec()
    }));
    let columns = [
        Column::Left("cheapest to"),
        Column::Left("method"),
        Column::Left("steps"),
        Column::Right("rms error"),
        Column::Right("s per simulated s"),
    ];
    table(&columns, &rows)
}

/// What limits the time in which runs are compared, what it would take to go further, how good the reference is, how fast copies of
/// cloth grow apart, of snow what its cells leave open, and how near a coarser copy comes.
pub(crate) fn summary(chart: &Chart) -> String {
    let growth = chart.growth_rate().map(growth);
    let parts = [Some(limit(chart)), cut(chart), known(chart), growth, cells(chart), coarser(chart)];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" ")
}

/// With which effort the reference was made, how well it is known, and what that leaves open.
pub(crate) fn known(chart: &Chart) -> Option<String> {
    let (effort, reference) = (chart.effort?, chart.reference.as_ref()?);
    let told = format!("By effort {effort} the reference is known to {}", length(reference.error()));
    let below = chart.rows.iter().filter(|row| row.at_most.is_some()).count();
    Some(match below {
        0 => format!("{told}."),
        1 => format!("{told}: 1 run is nearer to it than can be told, and known as \"at most\" alone."),
        _ => {
            format!("{told}: {below} runs are nearer to it than can be told, and known as \"at most\" alone.")
        }
    })
}

/// What is not known for want of time, where something is.
fn cut(chart: &Chart) -> Option<String> {
    let is_cut = chart.is_cut && chart.reference.is_some();
    is_cut.then(|| {
        let runs = chart.rows.iter().filter(|row| row.end.cut().is_some()).count();
        let why = if chart.is_stopped { "Interrupted" } else { "Out of time" };
        let runs = if runs == 1 { "1 run".to_owned() } else { format!("{runs} runs") };
        format!("{why}: not every method was followed to its end, and of {runs} nothing is known; no other number depends on that.")
    })
}

/// How fast (1/s) what starts 1e-8 m apart grows apart, and what another displacement makes of the predictability horizon.
fn growth(rate: f64) -> String {
    if rate > 0.0 {
        let shorter = std::f64::consts::LN_10 / rate;
        format!(
            "What starts 1e-8 m apart grows apart at a mean rate of {rate:.2} 1/s until then: ten times the displacement would \
             shorten the predictability horizon by {shorter:.3} s."
        )
    } else {
        format!("What starts 1e-8 m apart does not grow apart until then (mean growth rate {rate:.2} 1/s).")
    }
}

/// What the cells of snow leave open, by how far the scene as it is written is from its reference.
fn cells(chart: &Chart) -> Option<String> {
    let reference = chart.reference.as_ref()?;
    let fine = reference.stepped.cell()?;
    let own = chart.rows.iter().find(|row| row.own)?;
    let (cell, error) = (own.stepped.cell()?, own.error()?);
    Some(format!(
        "Your cells of {} leave {} open: so far is the scene as it is written from its reference on cells of {}, which is known \
         to {}. Rows that are nearer to it than that are marked below_floor, and never ranked.",
        length(cell),
        length(error),
        length(fine),
        length(reference.error())
    ))
}

/// How near a coarser copy comes to the reference at the points that both have in common, and for which cost.
fn coarser(chart: &Chart) -> Option<String> {
    let copy = chart.coarser.as_ref()?;
    let held = copy.rows.iter().filter_map(|row| Some((row.error()?, row)));
    let Some((_, row)) = held.min_by(|(a, _), (b, _)| a.total_cmp(b)) else {
        return Some(format!("Of the copy {} no run came to the last of these times.", copy.name));
    };
    let cost = row.seconds.map_or_else(String::new, |s| format!(" for {} per simulated second", time(s)));
    Some(format!(
        "The copy {} is nearest by {} in {} with steps of {}: {} off at the points in common,{cost}.",
        copy.name,
        row.stepped.name(),
        row.stepped.precision(),
        steps(row),
        error(row)
    ))
}

/// What a part of a study needs (s), of which nothing is known for want of time.
pub(crate) fn needed(what: &str, seconds: f64) -> String {
    // What is needed is allowed two thirds of a budget.
    let budget = (2.0 * seconds).ceil().max(2.0);
    if budget.is_finite() && budget < 1e6 {
        format!("{what} take about {} s: try --budget {budget:.0}s.", three(seconds))
    } else {
        format!("{what} did not come far enough to tell how long they take: try --budget 10min.")
    }
}

/// What takes less where nothing is known for want of time.
fn smaller(chart: &Chart) -> String {
    let until = chart.fits.map(|fits| format!("--until {fits}"));
    let effort = chart.effort.map(Effort::class).filter(|class| *class > 0);
    let effort = effort.map(|class| format!("--effort {}", class - 1));
    let asked: Vec<String> = until.into_iter().chain(effort).collect();
    if asked.is_empty() { String::new() } else { format!(" Less is asked by {}.", asked.join(" or ")) }
}

/// How well what is not the motion is known at a number of times.
fn measured(chart: &Chart, count: u64) -> String {
    let (what, floor) = (chart.measure.words(), length(chart.floor));
    if chart.reference.is_none() {
        return format!(
            "Nothing can be planned: {what} is known to {floor}, and a plan needs {}, a quarter of the tolerance. What starts 1e-8 m apart, and \
             what is run in half the steps, has another answer. It may be known at an earlier end (--until) or to a larger --tolerance; \
             `nappe chart` compares what is less well known.",
            length(0.25 * chart.tolerance)
        );
    }
    format!("Compared {} ({}): there it is known to {floor}.", chart.compared(), several(count, "time"))
}

/// What limits the time in which runs are compared.
pub(crate) fn limit(chart: &Chart) -> String {
    let count = chart.reference.as_ref().map_or(0, |reference| reference.times.marks.len());
    let until = format!("at {count} times until {}", moment(chart.until()));
    let quarter = length(0.25 * chart.tolerance);
    if let Some(missing) = &chart.missing {
        return match missing {
            NoReference::Time(seconds) => {
                let needed = needed("The predictability horizon and the reference", *seconds);
                format!("Nothing is known: out of time. {needed}{}", smaller(chart))
            }
            NoReference::Failed(cause) => format!("There is no reference: {cause}."),
        };
    }
    if chart.measure != Measure::Motion && chart.whole.is_some() {
        return measured(chart, count as u64);
    }
    if chart.reference.is_none() {
        let first = chart.scan.spread.first().map_or_else(
            || "not one time was reached".to_owned(),
            |spread| {
                format!(
                    "runs that start 1e-8 m apart are {} apart after {:.2e} s",
                    length(*spread),
                    chart.scan.spacing
                )
            },
        );
        return match &chart.limit {
            Limit::Failed(cause) => format!("Nothing can be compared: {cause}."),
            _ => {
                format!("Nothing can be compared: {first}, more than {quarter}, a quarter of the tolerance.")
            }
        };
    }
    match &chart.limit {
        Limit::Asked if chart.scan.spread.is_empty() => {
            format!("Compared {until}, as was asked for.")
        }
        Limit::Asked => format!(
            "Compared {until}, as was asked for; what starts 1e-8 m apart is then up to {} apart.",
            length(chart.scan.spread.iter().copied().fold(0.0, f64::max))
        ),
        Limit::Scene => format!("Compared {until}, the end of the scene."),
        Limit::Spread => format!(
            "Compared {until}, the predictability horizon for a displacement of 1e-8 m: after that, runs that start so far apart are more than {quarter} apart, and no method has an answer to {}.",
            length(chart.tolerance)
        ),
        Limit::Reference => {
            format!("Compared {until}: after that, the reference is not known to {quarter}.")
        }
        Limit::Work => format!(
            "Compared {until}: further on a reference would take more work than its effort allows; --until asks for a time, a larger \
             --effort for more work."
        ),
        Limit::Failed(cause) => {
            format!("Compared {until}: after that a reference run failed, {cause}.")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_growth_rate_says_how_the_horizon_scales() {
        let told = growth(9.74);
        assert!(told.contains("9.74 1/s") && told.ends_with("by 0.236 s."), "{told}");
        assert!(growth(-1.5).ends_with("(mean growth rate -1.50 1/s)."));
    }
}

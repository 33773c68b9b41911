//! A study of stability in words: the limits of every method, and what it found.

use nappe_study::{Effort, NoReference, Over, Stability, StabilityRow, Stepping, Verdict, WRONG};

use crate::{
    studies::chart::words::needed,
    words::output::{Column, length, table, time},
};

/// What stands in place of what was not followed to its end.
const NOT_KNOWN: &str = "not known";

/// What a limit is.
fn limit(row: Option<&StabilityRow>) -> String {
    match row {
        None => String::new(),
        Some(row) if row.verdict == Verdict::NotKnown => NOT_KNOWN.to_owned(),
        Some(row) if row.is_refused() => format!("{NOT_KNOWN}: refused"),
        Some(row) => match row.limit {
            Some(0.0) => "none holds".to_owned(),
            Some(limit) => time(limit),
            None => format!("> {}", time(row.dt)),
        },
    }
}

/// The longest step of a method under load that was stable and right.
fn right(study: &Stability, load: Option<&StabilityRow>) -> String {
    match load {
        None => String::new(),
        // Without a window there is nothing to be right by.
        Some(row) if row.verdict == Verdict::NotKnown || row.is_refused() || study.window == 0.0 => {
            NOT_KNOWN.to_owned()
        }
        Some(row) => match row.right {
            Some(0.0) => "none is".to_owned(),
            Some(right) => time(right),
            None if row.verdict.holds() => NOT_KNOWN.to_owned(),
            None => String::new(),
        },
    }
}

/// Limits of every method, and what becomes of it as the program runs it.
pub(crate) fn limits(study: &Stability) -> String {
    let rest: Vec<_> = study.limits(Over::Rest).collect();
    let row = |rest: &&StabilityRow| {
        let method = rest.method;
        let load = study.limits(Over::Load).find(|row| row.method == method);
        let runs =
            study.rows.iter().filter(|row| row.stepping == Stepping::Certified && row.method == method);
        let named = |verdict: Verdict| if verdict == Verdict::NotKnown { NOT_KNOWN } else { verdict.name() };
        let runs: Vec<_> = runs.map(|row| named(row.verdict)).collect();
        vec![
            method.name(),
            rest.theory
                .map(|theory| if theory > 0.0 { time(theory) } else { "none".to_owned() })
                .unwrap_or_default(),
            limit(Some(rest)),
            rest.bound.map(time).unwrap_or_default(),
            limit(load),
            right(study, load),
            runs.join(", "),
        ]
    };
    let columns = [
        Column::Left("longest stable step"),
        Column::Right("in theory"),
        Column::Right("at rest"),
        Column::Right("certified"),
        Column::Right("under load"),
        Column::Right("right up to"),
        Column::Left("as run at 1, 4, 16, 64 dt"),
    ];
    table(&columns, &rest.iter().map(row).collect::<Vec<_>>())
}

/// What was judged, and what went wrong.
pub(crate) fn summary(study: &Stability) -> String {
    let stable = "Under load a method is stable while its energy stays near that of a fine run";
    let mut text = match &study.missing {
        Some(_) => missing(study).unwrap_or_default(),
        None if study.window == 0.0 => format!(
            "{stable}; what is wrong could not be told: what starts 1e-8 m apart parts at once, or the reference is not known."
        ),
        None => format!(
            "{stable}, and right while it is within {} of a reference until {}, the predictability horizon for a displacement \
             of 1e-8 m{}.",
            length(WRONG * study.tolerance),
            time(study.window),
            study.growth_rate.map_or_else(String::new, |rate| format!(" (mean growth rate {rate:.1} 1/s)"))
        ),
    };
    if let (Some(effort), true) = (study.effort, study.judged > 0.0) {
        text = format!("{text} By effort {effort} runs are judged until {} at most.", time(study.judged));
    }
    let lost = study.lost().count();
    if lost > 0 {
        text = format!(
            "{text} {lost} runs lost their way without a word, which is an error of this program: see outcome lost in \
             stability.csv."
        );
    }
    if let Some(refused) = refused(study) {
        text = format!("{text} {refused}");
    }
    if study.is_cut && study.missing.is_none() {
        text = format!("{text} {}", cut(study));
    }
    text
}

/// How many limits are not known because steps are refused, and why the first is.
fn refused(study: &Stability) -> Option<String> {
    let refused = || study.rows.iter().filter(|row| row.is_limit && row.is_refused());
    let first = refused().next()?;
    let cause = first.cause.as_deref().unwrap_or_default().trim_end_matches('.');
    Some(format!(
        "Not known are {} limits, since their steps are refused before the first; that of {}: {cause}.",
        refused().count(),
        first.method.name()
    ))
}

/// Why nothing could be judged under load, if nothing could.
pub(super) fn missing(study: &Stability) -> Option<String> {
    Some(match study.missing.as_ref()? {
        NoReference::Failed(cause) => {
            format!("Nothing could be judged under load: {}.", cause.trim_end_matches('.'))
        }
        NoReference::Time(_) if study.is_stopped => "Nothing is known: interrupted.".to_owned(),
        NoReference::Time(seconds) => {
            let needed = needed("The predictability horizon and a fine run of the scene", *seconds);
            let class = study.effort.map(Effort::class).filter(|class| *class > 0);
            let smaller =
                class.map_or_else(String::new, |class| format!(" Less is asked by --effort {}.", class - 1));
            format!("Nothing is known: out of time. {needed}{smaller}")
        }
    })
}

/// What is not known for want of time.
fn cut(study: &Stability) -> String {
    let count = |is_one: &dyn Fn(&StabilityRow) -> bool| {
        study
            .rows
            .iter()
            .filter(|row| row.verdict == Verdict::NotKnown && row.cut.is_some() && is_one(row))
            .count()
    };
    let limits = count(&|row| row.is_limit);
    let runs = count(&|row| row.stepping == Stepping::Certified);
    let cells = count(&|row| row.across.is_some());
    let rights = study
        .rows
        .iter()
        .filter(|row| row.is_limit && row.verdict != Verdict::NotKnown && row.cut.is_some())
        .count();
    let why = if study.is_stopped { "Interrupted" } else { "Out of time" };
    format!(
        "{why}: {limits} limits, {rights} steps up to which a method is right, {runs} runs as the program makes them and {cells} cells of maps are not known; a larger --budget goes \
         further, and changes nothing of what is known."
    )
}

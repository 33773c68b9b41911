//! A study of stability in words: the limits of every method, and what it found.

use nappe_study::{Fate, Method, Over, Stability, StabilityRow, Stepping, WRONG};

use crate::output::{Column, table};

/// A time (s) as people write it, in three digits.
fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s >= 1.0 => (s, "s"),
        s if s >= 1e-3 => (s * 1e3, "ms"),
        s => (s * 1e6, "us"),
    };
    let digits = (2 - value.abs().max(1e-3).log10().floor() as i32).clamp(0, 4) as usize;
    format!("{value:.digits$} {unit}")
}

/// What a limit is.
fn limit(row: Option<&StabilityRow>) -> String {
    match row {
        None => String::new(),
        Some(row) if row.fate == Fate::Stopped => "not finished".to_owned(),
        Some(row) => match row.limit {
            Some(0.0) => "none holds".to_owned(),
            Some(limit) => time(limit),
            None => format!("> {}", time(row.dt)),
        },
    }
}

/// The longest step (s) of a method under load that was stable and right.
fn right(study: &Stability, method: Method) -> Option<f64> {
    let probes = study.rows.iter().filter(|row| row.over == Over::Load && row.method == method);
    probes.filter(|row| row.fate == Fate::Stable).map(|row| row.dt).reduce(f64::max)
}

/// Limits of every method, and what becomes of it as the program runs it.
pub(crate) fn limits(study: &Stability) -> String {
    let rest: Vec<_> = study.limits(Over::Rest).collect();
    let row = |rest: &&StabilityRow| {
        let method = rest.method;
        let load = study.limits(Over::Load).find(|row| row.method == method);
        let runs =
            study.rows.iter().filter(|row| row.stepping == Stepping::Certified && row.method == method);
        let runs: Vec<_> = runs.map(|row| row.fate.name()).collect();
        vec![
            method.name(),
            rest.theory
                .map(|theory| if theory > 0.0 { time(theory) } else { "none".to_owned() })
                .unwrap_or_default(),
            limit(Some(rest)),
            rest.bound.map(time).unwrap_or_default(),
            limit(load),
            right(study, method).map(time).unwrap_or_default(),
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
        Some(cause) => format!("Nothing could be judged under load: {cause}."),
        None if study.window == 0.0 => format!(
            "{stable}; what is wrong could not be told: there was no time for a reference, or what starts 1e-8 m apart parts at once."
        ),
        None => format!(
            "{stable}, and right while it is within {} mm of a reference until {}, the predictability horizon for a displacement \
             of 1e-8 m{}.",
            1e3 * WRONG * study.tolerance,
            time(study.window),
            study.growth_rate.map_or_else(String::new, |rate| format!(" (mean growth rate {rate:.1} 1/s)"))
        ),
    };
    let lost = study.lost().count();
    if lost > 0 {
        text = format!(
            "{text} {lost} runs lost their way without a word, which is an error of this program: see outcome lost in \
             stability.csv."
        );
    }
    if study.is_cut {
        text.push_str(" The budget was too short for all of it; a larger one goes further.");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_three_digits() {
        for (seconds, text) in [
            (5.33e-3, "5.33 ms"),
            (6.667e-7, "0.667 us"),
            (0.32, "320 ms"),
            (2.5, "2.50 s"),
            (4.2e-4, "420 us"),
        ] {
            assert_eq!(time(seconds), text);
        }
    }
}

//! Lengths and times in the words of pictures.

use nappe_study::{Row, cheapest};

/// A length (m) in the unit that suits it, with two digits.
pub(crate) fn length(metres: f64) -> String {
    match metres {
        m if m >= 1.0 => format!("{} m", two(m)),
        m if m >= 1e-6 => format!("{} mm", two(m * 1e3)),
        m => format!("{m:.0e} m"),
    }
}

/// A time (s) in the unit that suits it, with two digits.
pub(crate) fn time(seconds: f64) -> String {
    in_unit(seconds, two)
}

/// A time (s) in the unit that suits it, with three digits.
pub(crate) fn finer_time(seconds: f64) -> String {
    in_unit(seconds, three)
}

fn in_unit(seconds: f64, number: fn(f64) -> String) -> String {
    match seconds {
        s if s >= 1.0 => format!("{} s", number(s)),
        s if s >= 1e-3 => format!("{} ms", number(s * 1e3)),
        s => format!("{} µs", number(s * 1e6)),
    }
}

/// A number with two digits that count.
pub(crate) fn two(value: f64) -> String {
    rounded(value, 2)
}

/// A number with three digits that count.
pub(crate) fn three(value: f64) -> String {
    rounded(value, 3)
}

/// Names or clauses one after another, the last after "and".
pub(crate) fn listed(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

fn rounded(value: f64, count: i32) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let first = value.abs().log10().floor() as i32;
    if first >= count {
        let unit = 10_f64.powi(first - (count - 1));
        return format!("{:.0}", (value / unit).round() * unit);
    }
    let digits = (count - 1 - first).clamp(0, 9) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A name of a method as it stands within a sentence, where commas part names: what specifies it is in parentheses.
pub(crate) fn within(name: &str) -> String {
    name.split_once(", ").map_or_else(|| name.to_owned(), |(first, rest)| format!("{first} ({rest})"))
}

/// What is cheapest to a tolerance (m), as a clause.
pub(crate) fn cheapest_to(rows: &[Row], tolerance: f64) -> String {
    match cheapest(rows, tolerance) {
        None => format!("no row comes within {}", length(tolerance)),
        Some(row) => format!(
            "{} in {} with steps of {} is the cheapest to {}: {} s per simulated second",
            within(&row.stepped.reader_name()),
            row.stepped.precision(),
            time(row.dt),
            length(tolerance),
            row.seconds.map_or_else(String::new, two)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_two_digits_that_count() {
        for (value, text) in [(0.0123, "0.012"), (1.0, "1"), (0.25, "0.25"), (123.4, "120"), (9.99, "10")] {
            assert_eq!(two(value), text);
        }
        assert_eq!([length(1e-3), length(2.5), length(3e-9)], ["1 mm", "2.5 m", "3e-9 m"]);
        assert_eq!([time(2e-5), time(0.0025), time(1.5)], ["20 µs", "2.5 ms", "1.5 s"]);
    }

    #[test]
    fn names_within_sentences_have_no_comma_that_parts_names() {
        let names = ["velocity Verlet", "BDF2, Newton, controlled steps"].map(within);
        assert_eq!(names, ["velocity Verlet", "BDF2 (Newton, controlled steps)"]);
    }

    #[test]
    fn finer_numbers_have_three_digits_and_lists_end_in_and() {
        for (value, text) in [(5.333, "5.33"), (320.0, "320"), (1234.0, "1230"), (0.0, "0")] {
            assert_eq!(three(value), text);
        }
        assert_eq!([finer_time(0.005_333), finer_time(0.32)], ["5.33 ms", "320 ms"]);
        let names = ["a", "b", "c"].map(str::to_owned);
        assert_eq!([listed(&names), listed(&names[..1])], ["a, b and c", "a"]);
    }
}

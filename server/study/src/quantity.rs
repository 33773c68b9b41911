//! Numbers, lengths, times and counts as people read them, in words, tables and pictures alike.

/// A number with three digits that count, zeros at its end among them.
pub fn three(value: f64) -> String {
    // Zero has no sign.
    let value = value + 0.0;
    let first = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    if (3..300).contains(&first) {
        let unit = 10_f64.powi(first - 2);
        return format!("{:.0}", (value / unit).round() * unit);
    }
    let digits = (2 - first).clamp(0, 9) as usize;
    format!("{value:.digits$}")
}

/// A number with three digits that count, without zeros at its end.
pub fn number(value: f64) -> String {
    let text = three(value);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A length (m) in the unit that suits it.
pub fn length(metres: f64) -> String {
    match metres {
        m if m >= 1.0 => format!("{} m", number(m)),
        m if m >= 1e-6 => format!("{} mm", number(m * 1e3)),
        m => format!("{m:.1e} m"),
    }
}

/// How long something takes (s), in the unit that suits it.
pub fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s >= 7200.0 => (s / 3600.0, "h"),
        s if s >= 120.0 => (s / 60.0, "min"),
        s if s >= 1.0 => (s, "s"),
        s if s >= 1e-3 => (s * 1e3, "ms"),
        s => (s * 1e6, "µs"),
    };
    format!("{} {unit}", three(value))
}

/// When something is in a scene (s), to the millisecond.
pub fn moment(seconds: f64) -> String {
    format!("{seconds:.3} s")
}

/// A count with blanks between thousands.
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// A count with what is counted: `1 thread`, `2 threads`.
pub fn several(of: u64, noun: &str) -> String {
    format!("{} {noun}{}", count(of), if of == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_no_plural() {
        let counted = [0, 1, 2, 1000].map(|of| several(of, "thread"));
        assert_eq!(counted, ["0 threads", "1 thread", "2 threads", "1 000 threads"]);
    }

    #[test]
    fn numbers_have_three_digits_that_count() {
        for (value, text) in [
            (0.0123, "0.0123"),
            (1.0, "1.00"),
            (123.4, "123"),
            (1234.0, "1230"),
            (-0.25, "-0.250"),
            (0.0, "0.00"),
            (-0.0, "0.00"),
            (f64::INFINITY, "inf"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(three(value), text, "{value}");
        }
        for (value, text) in [(5.333, "5.33"), (320.0, "320"), (0.25, "0.25"), (9.999, "10"), (0.0, "0")] {
            assert_eq!(number(value), text, "{value}");
        }
    }

    #[test]
    fn lengths_have_three_digits_and_a_unit() {
        for (metres, text) in [
            (1e-3, "1 mm"),
            (0.25e-3, "0.25 mm"),
            (0.012_345, "12.3 mm"),
            (2.5, "2.5 m"),
            (0.1, "100 mm"),
            (1.2e-6, "0.0012 mm"),
            (3e-9, "3.0e-9 m"),
        ] {
            assert_eq!(length(metres), text);
        }
    }

    #[test]
    fn times_have_three_digits_and_a_unit() {
        for (seconds, text) in [
            (5.33e-3, "5.33 ms"),
            (6.667e-7, "0.667 µs"),
            (0.32, "320 ms"),
            (2.5, "2.50 s"),
            (4.2e-4, "420 µs"),
            (8.62e-5, "86.2 µs"),
            (600.0, "10.0 min"),
            (9000.0, "2.50 h"),
        ] {
            assert_eq!(time(seconds), text);
        }
        assert_eq!(moment(1.04), "1.040 s");
    }

    #[test]
    fn counts_are_grouped_by_thousands() {
        for (value, text) in
            [(0, "0"), (999, "999"), (1_000, "1 000"), (160_000, "160 000"), (1_234_567, "1 234 567")]
        {
            assert_eq!(count(value), text);
        }
    }
}

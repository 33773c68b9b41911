//! A number as people write it in messages and pages.

/// Below this size a number is written with an exponent.
const SMALL: f64 = 1e-4;
/// From this size on too.
const LARGE: f64 = 1e15;

/// A number as people write it, short and exact: 0, 0.0001, 200, 1000000, 1e-6. Zero has no sign.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if size.is_finite() && !(SMALL..LARGE).contains(&size) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

/// The same with four digits, for what was measured.
pub fn four_digits(value: f64) -> String {
    number(format!("{value:.3e}").parse().unwrap_or(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        for (value, written) in [
            (0.0, "0"),
            (-0.0, "0"),
            (5.0, "5"),
            (-5.0, "-5"),
            (0.1, "0.1"),
            (1e-4, "0.0001"),
            (9.9e-5, "9.9e-5"),
            (1e6, "1000000"),
            (-1e14, "-100000000000000"),
            (1e15, "1e15"),
            (-2.5e300, "-2.5e300"),
            (f64::INFINITY, "inf"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(number(value), written);
        }
    }

    #[test]
    fn what_was_measured_has_four_digits() {
        for (value, written) in
            [(0.0, "0"), (1.0, "1"), (1.234_567, "1.235"), (123_456.0, "123500"), (2e-7, "2e-7")]
        {
            assert_eq!(four_digits(value), written);
        }
    }
}

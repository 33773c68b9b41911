//! Lengths and times as they are typed: a number with a unit.

use std::time::Duration;

use nappe_server::numbers::{METRES, SECONDS};

/// A length in metres: `1mm`, `0.5 cm`, `2e-4m`; without a unit, metres.
pub(crate) fn length(text: &str) -> Result<f64, String> {
    METRES.read(text).filter(|metres| *metres > 0.0).ok_or_else(|| {
        format!("'{text}' is not a length above 0: a number with mm, cm, µm or m, such as 1mm")
    })
}

/// A time: `60s`, `500ms`, `2min`, `1h`; without a unit, seconds.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    let seconds = SECONDS.read(text).filter(|seconds| *seconds > 0.0);
    seconds
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .ok_or_else(|| format!("'{text}' is not a time above 0: a number with ms, s, min or h, such as 60s"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_units() {
        for (text, metres) in
            [("1mm", 1e-3), ("0.1 mm", 1e-4), ("2e-4m", 2e-4), ("0.25", 0.25), ("5um", 5e-6), ("5µm", 5e-6)]
        {
            assert_eq!(length(text), Ok(metres), "{text}");
        }
        for (text, seconds) in [("60s", 60.0), ("2min", 120.0), ("0.5", 0.5), ("250ms", 0.25), ("1h", 3600.0)]
        {
            assert_eq!(duration(text), Ok(Duration::from_secs_f64(seconds)), "{text}");
        }
        for wrong in ["0", "-1mm", "mm", "nan", "inf", "1 km", ""] {
            assert!(length(wrong).is_err() && duration(wrong).is_err(), "{wrong}");
        }
        assert!(duration("1e300s").is_err());
    }
}

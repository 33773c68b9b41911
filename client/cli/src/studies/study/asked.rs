//! What verbs of studies are asked for: methods by their names, until when, to which error, and with which effort.

use nappe_scene::{Scene, suggestion};
use nappe_study::{Case, Effort};

use super::units;
use crate::words::{
    error::{CliError, Result},
    output::length,
};

/// The least error (m) that can be asked for.
const LEAST_TOLERANCE: f64 = 1e-12;
/// The largest error (m) that can be asked for where the scene is a single point.
const LARGEST_OF_A_POINT: f64 = 1000.0;

/// Refuses a method that is not among those that are known.
///
/// # Errors
/// The first of them, with the nearest name.
pub(crate) fn check_methods(asked: &[String], known: &[String]) -> Result<()> {
    match asked.iter().find(|name| !known.contains(name)) {
        None => Ok(()),
        Some(wrong) => {
            let near = suggestion(wrong, known.iter().map(String::as_str));
            Err(CliError::usage(format!("--method {wrong}: there is no such method; {near}")))
        }
    }
}

/// The end (s) of a study: as it is asked for, or that of the scene.
///
/// # Errors
/// A scene without end, where no time is asked for.
pub(crate) fn end(until: Option<f64>, scene: &Scene) -> Result<f64> {
    let end = until.unwrap_or(scene.steps as f64 * scene.dt);
    if end == 0.0 {
        return Err(CliError::usage("the scene has no end, steps = 0: say until when with --until S"));
    }
    Ok(end)
}

/// Evaluations of the force on a particle per second of a fast machine, and seconds of a year.
const PACE: f64 = 1e8;
const YEAR: f64 = 3.156e7;

/// A class of effort: `3`, `E3`.
pub(crate) fn effort(text: &str) -> std::result::Result<Effort, String> {
    let number = text.strip_prefix(['E', 'e']).unwrap_or(text);
    let class = number.parse::<u8>().ok().ok_or_else(|| {
        format!("'{text}' is not a class of effort: a whole number from 0 to {}, such as 3", Effort::MOST)
    })?;
    Effort::new(class).ok_or_else(|| {
        let [default, own] = [Effort::DEFAULT.class(), class].map(f64::from);
        let work = Effort::DEFAULT.of_cloth() as f64 * 4_f64.powf(own - default);
        format!(
            "a run of effort {class} would take up to {work:.1e} evaluations of the force on a particle, {:.1e} years on a fast machine; \
             allowed: 0 to {}",
            work / PACE / YEAR,
            Effort::MOST
        )
    })
}

/// The error (m) that is allowed: one that positions can have, and that not every answer has.
///
/// # Errors
/// What is no length, and one that no answer or every answer is within.
pub(crate) fn tolerance(text: &str, case: &Case) -> Result<f64> {
    let refused = |what: String| CliError::usage(format!("--tolerance {text}: {what}"));
    let tolerance = units::length(text).map_err(|error| CliError::usage(format!("--tolerance: {error}")))?;
    if tolerance < LEAST_TOLERANCE {
        return Err(refused(format!(
            "is less than numbers of 64 bits tell of positions; allowed: {LEAST_TOLERANCE:e} m and more"
        )));
    }
    let longest = case.diagonal();
    if longest > 0.0 && tolerance > longest {
        return Err(refused(format!(
            "any answer would be within it, since the scene is {} long; a smaller one is needed, such as {}",
            length(longest),
            length(1e-3 * longest)
        )));
    }
    if longest == 0.0 && tolerance > LARGEST_OF_A_POINT {
        return Err(refused(format!(
            "is more than a scene of a single point has use for; allowed: {LARGEST_OF_A_POINT} m and less"
        )));
    }
    Ok(tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_of_effort_is_a_small_number_or_what_it_would_take_is_said() {
        for (text, class) in [("0", 0), ("3", 3), ("E3", 3), ("e9", 9)] {
            assert_eq!(effort(text).map(Effort::class), Ok(class), "{text}");
        }
        for wrong in ["", "-1", "1.5", "three", "256"] {
            let message = effort(wrong).expect_err("no class");
            assert!(message.ends_with("a whole number from 0 to 9, such as 3"), "{message}");
        }
        let message = effort("99").expect_err("too much");
        assert!(message.contains("years on a fast machine; allowed: 0 to 9"), "{message}");
    }
}

//! What verbs of studies are asked for: methods by their names, until when, and to which error.

use nappe_scene::{Scene, suggestion};
use nappe_study::Case;

use super::units;
use crate::{
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

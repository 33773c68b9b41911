//! What verbs of studies are asked for: methods by their names, and until when.

use nappe_scene::{Scene, suggestion};

use crate::error::{CliError, Result};

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
/// A time that is not above 0, and a scene without end.
pub(crate) fn end(until: Option<f64>, scene: &Scene) -> Result<f64> {
    let end = until.unwrap_or(scene.steps as f64 * scene.dt);
    if until.is_some_and(|until| !(until.is_finite() && until > 0.0)) {
        return Err(CliError::usage(format!("--until {end}: a number of seconds above 0 is needed")));
    }
    if end == 0.0 {
        return Err(CliError::usage("the scene has no end, steps = 0: say until when with --until S"));
    }
    Ok(end)
}

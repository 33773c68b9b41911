//! What a scene may ask of cloth that lies still: an error that rounding of positions does not hide, and steps that can be long.

use crate::{
    cloth::{
        network::Network,
        settings::{ClothSettings, Integrator, RestSettings},
    },
    math::{Real, number},
};

/// What is wrong with the settings for rest of a network whose positions are in this precision, as a sentence.
pub(crate) fn check_rest<R: Real>(network: &Network, settings: &ClothSettings) -> Result<(), String> {
    let Some(RestSettings { error, within, sleep }) = settings.rest else { return Ok(()) };
    for (what, value, unit) in [("error", error, "m"), ("time", within, "s")] {
        if !value.is_finite() || value <= 0.0 {
            return Err(format!("the {what} of rest is {value} {unit}: a finite number above 0 is needed"));
        }
    }

    let largest = network.x.iter().flatten().fold(0.0_f64, |largest, c| largest.max(c.abs()));
    let least = RestSettings::LEAST_ROUNDINGS * R::ROUNDING * largest;
    if error < least {
        return Err(format!(
            "the error of rest is {} m: at least {} m is needed in {}, {} roundings of the largest coordinate, which is {} m",
            number(error),
            number(least),
            R::PRECISION,
            number(RestSettings::LEAST_ROUNDINGS),
            number(largest)
        ));
    }
    if sleep { check_sleep(settings) } else { Ok(()) }
}

/// What takes no long steps, as a sentence.
fn check_sleep(settings: &ClothSettings) -> Result<(), String> {
    let refused = |what: &str, allowed: &str| {
        Err(format!(
            "{what} takes no long steps while it sleeps: {allowed}, or sleep = false in [rest], which watches alone"
        ))
    };
    if settings.integrator != Integrator::ImplicitEuler {
        let name = settings.integrator.name();
        return refused(&format!("integrator = \"{name}\""), "\"implicit_euler\" is needed");
    }
    if !settings.starts_with_one_solve() {
        let name = settings.minimizer.kind().name();
        return refused(&format!("minimizer = \"{name}\""), "\"one_step\" or \"auto\" is needed");
    }
    if settings.time_step.is_unchecked() {
        return refused("a time step that is unchecked", "one that is checked is needed");
    }
    Ok(())
}

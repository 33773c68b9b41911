//! What `--measure` of a study compares: the motion of a scene, its end, or a number of it.
//!
//! Enters: a measure as it is typed, and a case. Leaves: the case, of which that is compared.

use nappe_scene::{Layout, suggestion};
use nappe_study::{Case, Measure};

use crate::{
    options::particles::{self, Particle},
    words::error::{CliError, Result},
};

/// Measures as they are typed, with NAME for the number or the name of a particle.
const MEASURES: [&str; 7] =
    ["motion", "end", "energy", "sag", "particle.NAME.x", "particle.NAME.y", "particle.NAME.z"];

/// The case, of which what is asked for is compared.
///
/// # Errors
/// What is no measure, and what the scene does not have.
pub(crate) fn measuring(text: &str, case: Case) -> Result<Case> {
    let refused = |what: String| CliError::usage(format!("--measure {text}: {what}"));
    let measure = match text {
        "motion" => Measure::Motion,
        "end" => Measure::End,
        "energy" => Measure::Energy,
        "sag" => Measure::Sag,
        _ => coordinate(text, &case).map_err(refused)?,
    };
    case.measuring(measure).map_err(|error| refused(error.to_string()))
}

/// `particle.NAME.AXIS`; of several bodies that have the particle `particle.BODY:NAME.AXIS`.
fn coordinate(text: &str, case: &Case) -> std::result::Result<Measure, String> {
    let asked = text.strip_prefix("particle.").and_then(|rest| rest.rsplit_once('.'));
    let Some((name, along)) = asked else {
        return Err(format!("there is no such measure; {}", suggestion(text, MEASURES)));
    };
    let Some(axis) = Measure::AXES.iter().position(|known| *known == along) else {
        return Err(format!("'{along}' is no axis; allowed: {}", Measure::AXES.join(", ")));
    };
    let particle = if case.is_snow() { of_snow(name, case)? } else { of_cloth(name, case)? };
    Ok(Measure::Coordinate { name: name.to_owned(), particle, axis })
}

/// The place of a particle of snow, which has numbers alone.
fn of_snow(name: &str, case: &Case) -> std::result::Result<usize, String> {
    let found = Particle::parse(name)?.among(Layout::Free, case.particle_count());
    let found = found.map_err(|message| format!("the particle {message}"))?;
    one(name, &found.iter().map(|place| *place as usize).collect::<Vec<_>>())
}

/// The place of a particle among those of all cloths.
fn of_cloth(name: &str, case: &Case) -> std::result::Result<usize, String> {
    let (body, word) = name.rsplit_once(':').map_or((None, name), |(body, word)| (Some(body), word));
    let particle = Particle::parse(word)?;
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    for (own, first, network) in case.cloths().filter(|(own, ..)| body.is_none_or(|body| body == *own)) {
        let springs = network.springs.iter().map(|spring| spring.particles).collect();
        let layout = particles::layout(network.masses.len(), network.triangles.clone(), springs);
        match particle.among(layout, network.masses.len()) {
            Ok(places) => {
                let places: Vec<usize> = places.iter().map(|place| first + *place as usize).collect();
                found.push((own, places));
            }
            Err(message) => missing.push(format!("the particle of body '{own}' {message}")),
        }
    }
    match found.as_slice() {
        [(_, places)] => one(name, places),
        [] if missing.is_empty() => {
            let near = suggestion(body.unwrap_or_default(), case.cloths().map(|(own, ..)| own));
            Err(format!("no body is named '{}'; {near}", body.unwrap_or_default()))
        }
        [] => Err(missing.join("; ")),
        several => {
            let ways: Vec<String> = several.iter().map(|(own, _)| format!("particle.{own}:{word}")).collect();
            Err(format!("several bodies have a particle '{word}': {}", ways.join(", ")))
        }
    }
}

/// The only one of some places.
fn one(name: &str, places: &[usize]) -> std::result::Result<usize, String> {
    match places {
        [one] => Ok(*one),
        several => Err(format!("'{name}' means {} particles; one is compared", several.len())),
    }
}

#[cfg(test)]
mod tests {
    use nappe_scene::{NoMeshes, Scene, SceneLimits};

    use super::*;

    /// A sheet of 4 x 3 particles and a chain of 5, in a gravity (m/s²) downwards.
    fn case(gravity: f64) -> Case {
        let text = format!(
            "version = 1\ndt = 0.01\nsteps = 10\ngravity = [0, {}, 0]\n\
             [[body]]\nname = \"sheet\"\nmesh = {{ grid = [4, 3], spacing = 0.1 }}\nmass = {{ particle = 0.01 }}\n\
             springs = {{ stretch = {{ stiffness = 100 }} }}\n\
             [[body]]\nname = \"rope\"\nmesh = {{ chain = 5, spacing = 0.1 }}\nmass = {{ particle = 0.01 }}\n\
             springs = {{ stretch = {{ stiffness = 100 }} }}\n",
            -gravity
        );
        let scene = Scene::parse(&text, "two").expect("a scene");
        let built = scene.build(&NoMeshes, &SceneLimits::default()).expect("a world");
        Case::new("two", built.setup, built.initial_changes, scene.precision).expect("cloths")
    }

    fn place(text: &str) -> usize {
        match measuring(text, case(9.81)).expect(text).measure() {
            Measure::Coordinate { particle, .. } => *particle,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn particles_are_found_by_names_and_numbers_on_their_bodies() {
        assert_eq!(["particle.top_right.y", "particle.last.x"].map(place), [3, 16]);
        assert_eq!(["particle.sheet:4.y", "particle.rope:4.z", "particle.11.y"].map(place), [4, 16, 11]);
        for (text, measure) in [
            ("motion", Measure::Motion),
            ("end", Measure::End),
            ("sag", Measure::Sag),
            ("energy", Measure::Energy),
        ] {
            assert_eq!(measuring(text, case(9.81)).expect(text).measure(), &measure);
        }
    }

    #[test]
    fn what_is_not_there_is_refused_with_what_is() {
        for (text, part) in [
            (
                "heat",
                "--measure heat: there is no such measure; allowed: motion, end, energy, sag, particle.NAME.x",
            ),
            ("sagg", "did you mean 'sag'?"),
            ("particle.top_right.w", "'w' is no axis; allowed: x, y, z"),
            ("particle.top_rights.y", "did you mean 'top_right'?"),
            ("particle.top.y", "'top' means 4 particles; one is compared"),
            ("particle.99.y", "the particle of body 'sheet' is 99; allowed: 0 to 11"),
            ("particle.1.y", "several bodies have a particle '1': particle.sheet:1, particle.rope:1"),
            ("particle.rop:1.y", "no body is named 'rop'; did you mean 'rope'?"),
        ] {
            let message = measuring(text, case(9.81)).expect_err(text).message;
            assert!(message.contains(part), "{text}: {message}");
        }
        for text in ["energy", "sag"] {
            let message = measuring(text, case(0.0)).expect_err(text).message;
            assert!(message.contains("nothing that is free has a weight; allowed: motion, end"), "{message}");
        }
    }
}

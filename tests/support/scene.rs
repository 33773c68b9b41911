//! Worlds of one body, as the gallery of stability has them, and their runs.

use nappe_scene::{NoMeshes, Scene as SceneText, SceneLimits};
use nappe_sim::{
    math::Precision,
    report::{NoStopwatch, StepError, StepReport},
    world::Simulation,
};

pub use nappe_study::gallery::scene::{
    EXACT, Scene, cross, difference, max_distance, momenta, norm, positions, velocities,
};

use crate::threads::on_one_thread;

/// The simulation of a scene file that names no mesh.
///
/// # Panics
/// When it is refused.
pub fn of_text(text: &str, precision: Precision) -> Simulation {
    let scene = SceneText::parse(text, "scene").unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(&built.setup, precision).expect("a good scene").0
}

/// Takes `count` steps or stops at the first failure; gives the last report.
///
/// # Errors
/// The failure of a step.
pub fn try_advance(simulation: &mut Simulation, count: u64) -> Result<StepReport, StepError> {
    on_one_thread(|| {
        let mut report = StepReport::default();
        for _ in 0..count {
            report = simulation.step(&mut NoStopwatch)?;
        }
        Ok(report)
    })
}

/// Takes `count` steps, which must all succeed; gives the last report.
pub fn advance(simulation: &mut Simulation, count: u64) -> StepReport {
    try_advance(simulation, count).unwrap_or_else(|error| panic!("{error}"))
}

//! The simulation of a scene without a server, to compare with what the server sends.

use nappe_scene::{NoMeshes, Scene, SceneLimits};
use nappe_sim::{math::Precision, world::Simulation};

/// The simulation of a scene's text.
pub(crate) fn simulation(text: &str, precision: Precision) -> Simulation {
    let scene = Scene::parse(text, "test").expect("a scene");
    let built = scene.build(&NoMeshes, &SceneLimits::default()).expect("a world");
    Simulation::new(&built.setup, precision).expect("a simulation").0
}

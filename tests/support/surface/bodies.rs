//! Worlds of several bodies, each with a thickness of its own or without one.

use nappe_sim::{
    cloth::Network,
    math::Precision,
    world::{BodySetup, Simulation, WorldSetup},
};

use crate::Scene;

/// The world of a scene with other bodies, of which each has a name, its particles and springs, and a thickness (m).
pub fn of_bodies(scene: &Scene, bodies: Vec<(&str, Network, f64)>) -> WorldSetup {
    let body = |(name, network, thickness): (&str, Network, f64)| BodySetup {
        name: name.to_owned(),
        network: Network { thickness, ..network },
        settings: scene.settings,
        forces: Vec::new(),
    };
    WorldSetup { bodies: bodies.into_iter().map(body).collect(), ..scene.setup() }
}

/// The simulation of a world, which must be accepted.
pub fn built(setup: &WorldSetup, precision: Precision) -> Simulation {
    match Simulation::new(setup, precision) {
        Ok((simulation, _)) => simulation,
        Err(error) => panic!("the world was refused: {error}"),
    }
}

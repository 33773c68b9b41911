//! Every shipped scene, and the course's objects where they are present, run and stay finite.

use nappe_scene::{NoMeshes, Scene, SceneLimits, files, shipped_scenes};
use nappe_sim::{
    cloth::{Network, SpringLaw, SpringRules},
    math::Precision,
    world::Simulation,
};
use nappe_tests::{
    Method, course, networks,
    scene::{advance, positions},
    threads::with_threads,
};

/// Steps for a scene of so many particles: a second of computing or so.
fn step_count(particles: usize, wanted: u64) -> u64 {
    (300_000 / particles as u64).clamp(20, 300).min(wanted)
}

#[test]
fn every_shipped_scene_runs_keeps_its_pins_and_gains_no_energy() {
    // On all cores: nothing else runs as long.
    with_threads(0, run_every_scene);
}

fn run_every_scene() {
    for (name, text) in shipped_scenes() {
        let scene = Scene::parse(text, name).unwrap_or_else(|error| panic!("{error}"));
        let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
        for precision in Precision::ALL {
            let (mut simulation, _) =
                Simulation::new(&built.setup, precision).expect("a scene that is shipped");
            simulation.apply(&built.initial_changes).expect("changes of the scene itself");
            let before = positions(&simulation);
            let start = simulation.diagnose().total_energy();
            let count = step_count(simulation.particle_count(), scene.steps);
            let diagnostics = advance(&mut simulation, count).diagnostics;
            let after = positions(&simulation);
            assert!(after.iter().flatten().all(|c| c.is_finite()), "{name} in {precision}");
            assert_ne!(before, after, "{name} in {precision}");
            if built.initial_changes.is_empty() {
                for pin in simulation.topology().iter().flat_map(|body| body.pins.clone()) {
                    assert_eq!(after[pin as usize], before[pin as usize], "{name} in {precision}, pin {pin}");
                }
            }
            if built.setup.wind == [0.0; 3] && built.initial_changes.is_empty() {
                // Half of y² / 4 of leapfrog's kind at the scenes' steps, of what has been set in motion.
                let moved = diagnostics.kinetic_energy + diagnostics.elastic_energy;
                let gained = diagnostics.total_energy() - start;
                assert!(
                    gained < 0.1 * moved,
                    "{name} in {precision}: {gained} J gained of {moved} in motion"
                );
            }
        }
    }
}

#[test]
fn the_shipped_course_cloths_are_those_of_the_formula() {
    for (name, side) in [("drap10", 10), ("drap70", 70)] {
        let (_, text) = shipped_scenes().iter().find(|(n, _)| *n == name).expect("a scene of that name");
        let scene = Scene::parse(text, name).unwrap_or_else(|error| panic!("{error}"));
        let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
        let (ours, network) =
            (networks::drap(side, networks::DrapSprings::Faces, 0.01), &built.setup.bodies[0].network);
        assert_eq!(network.x, ours.x, "{name}");
        assert_eq!(network.springs.len(), ours.springs.len(), "{name}");
        for (a, b) in network.springs.iter().zip(&ours.springs) {
            assert_eq!((a.particles, a.rest_length, a.law), (b.particles, b.rest_length, b.law), "{name}");
        }

        let (simulation, _) = Simulation::new(&built.setup, Precision::F64).expect("a scene that is shipped");
        assert_eq!(simulation.topology()[0].pins, ours.pins, "{name}");
    }
}

#[test]
fn the_objects_of_the_course_fall_by_every_method() {
    let Some(folder) = course::folder("the_objects_of_the_course_fall_by_every_method") else { return };
    let law = SpringLaw { stiffness: 15_000.0, damping: 0.01 };
    let rules = SpringRules { stretch: law, shear: None, bend: None };
    for name in ["drap4", "drap10", "drap70", "vache", "sphere", "bunny", "pantalon"] {
        let loaded = files::load_mesh(&folder.join("data").join(name), &files::ReadOptions::default())
            .unwrap_or_else(|error| panic!("{error}"));
        let network = Network::from_mesh(&loaded.mesh, &rules, 1.0);
        for method in Method::all() {
            let scene = nappe_tests::Scene::new(network.clone(), 1e-3).by(method).under([0.0, -9.8, 0.0]);
            let mut scene = scene;
            scene.settings.solver = nappe_sim::linalg::SolverSettings::default();
            let mut simulation = scene.simulate(Precision::F32);
            let diagnostics = advance(&mut simulation, 20).diagnostics;
            assert!(diagnostics.total_energy().is_finite(), "{name} by {}", method.name());
            assert!(
                positions(&simulation).iter().flatten().all(|c| c.is_finite()),
                "{name} by {}",
                method.name()
            );
        }
    }
}

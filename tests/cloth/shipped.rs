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

use crate::scenes::scenes_run_keep_their_pins_and_gain_no_energy;

#[test]
fn every_shipped_scene_begins_well() {
    // On all cores: nothing else runs as long. `slow.rs` goes on for longer, in both precisions.
    with_threads(0, || scenes_run_keep_their_pins_and_gain_no_energy(&[Precision::F32], 15_000));
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

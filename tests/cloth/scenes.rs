//! The scenes that come with the program: each runs, keeps its pins and gains no energy.

use nappe_scene::{NoMeshes, Scene, SceneLimits, shipped_scenes};
use nappe_sim::{math::Precision, world::Simulation};
use nappe_tests::scene::{advance, positions};

/// Runs every shipped scene for so many steps times particles, 10 to 300 steps. Wind, figures, pins that move and colliders that move
/// give energy, so that it may grow there.
///
/// # Panics
/// When one cannot be built, does not move, moves its pins, or gains energy.
pub(crate) fn scenes_run_keep_their_pins_and_gain_no_energy(precisions: &[Precision], work: u64) {
    for (name, text) in shipped_scenes() {
        let scene = Scene::parse(text, name).unwrap_or_else(|error| panic!("{error}"));
        let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
        for &precision in precisions {
            let (mut simulation, _) =
                Simulation::new(&built.setup, precision).expect("a scene that is shipped");
            simulation.apply(&built.initial_changes).expect("changes of the scene itself");
            let before = positions(&simulation);
            let start = simulation.diagnose().total_energy();
            let count = (work / simulation.particle_count() as u64).clamp(10, 300).min(scene.steps);
            let diagnostics = advance(&mut simulation, count).diagnostics;
            let after = positions(&simulation);
            assert!(after.iter().flatten().all(|c| c.is_finite()), "{name} in {precision}");
            assert_ne!(before, after, "{name} in {precision}");
            if built.initial_changes.is_empty() {
                for pin in simulation.topology().iter().flat_map(|body| body.pins.clone()) {
                    assert_eq!(after[pin as usize], before[pin as usize], "{name} in {precision}, pin {pin}");
                }
            }
            let rests = built.setup.colliders.iter().all(|it| it.way.is_none() && it.velocity == [0.0; 3])
                && !built.setup.bodies.iter().any(|body| body.network.is_figure());
            if built.setup.wind == [0.0; 3] && built.initial_changes.is_empty() && rests {
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

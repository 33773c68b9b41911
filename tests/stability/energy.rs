//! Energy over long runs of certified explicit steps of cloth: their length must not follow the motion.
//!
//! Reads scenes that once gained energy without end, or were ended for what is no gain.

use nappe_sim::{
    cloth::{ClothSettings, Integrator},
    math::Precision,
    time_step::TimeStep,
    world::Simulation,
};
use nappe_tests::{
    Scene,
    networks::{DrapSprings, drap, sheet, sheet_rules},
    scene::advance,
};

#[test]
fn the_cloth_of_the_course_gains_no_more_than_its_method_swings_by() {
    // Its motion has 193 J. With a length that followed the bound it gained 348 J by velocity Verlet at 10 ms, 1600 J by
    // symplectic Euler.
    for integrator in
        [Integrator::SymplecticEuler, Integrator::VelocityVerlet, Integrator::VelocityVerletPredicted]
    {
        for dt in [2e-3, 3e-3, 5e-3, 7e-3, 0.01, 0.013, 0.017, 0.02, 0.03, 0.04] {
            let mut scene = Scene::new(drap(10, DrapSprings::Faces, 0.0), dt).under([0.0, -9.81, 0.0]);
            scene.settings = ClothSettings { integrator, time_step: TimeStep::default(), ..scene.settings };
            let mut simulation = scene.simulate(Precision::F32);
            let start = simulation.diagnose().total_energy();
            let mut gained = 0.0_f64;
            for _ in 0..(10.0 / dt) as u32 {
                gained = gained.max(advance(&mut simulation, 1).diagnostics.total_energy() - start);
            }
            assert!(gained < 0.1 * 193.0, "{integrator:?}, dt {dt}: {gained} J");
        }
    }
}

#[test]
fn a_damped_fall_by_explicit_euler_is_not_ended_for_the_error_of_its_method() {
    // Nothing moves at the start, and h² g² m / 2 per step is what explicit Euler adds to a fall.
    let mut network = sheet(8, 0.13, &sheet_rules(350.0, 0.4), 0.05);
    network.pins = vec![0, 37];
    network.drag = 0.05;
    let mut scene = Scene::new(network, 2e-4).under([0.0, -9.81, 0.0]);
    scene.wind = [1.5, 0.0, -0.7];
    scene.settings = ClothSettings {
        integrator: Integrator::ExplicitEuler,
        time_step: TimeStep::default(),
        ..scene.settings
    };
    let mut simulation = scene.simulate(Precision::F64);
    advance(&mut simulation, 2_000);

    // Undamped, the same error is growth, and is called so.
    let still = scene.settings.integrator;
    let mut free = Scene::new(drap(10, DrapSprings::Faces, 0.0), 5e-3).under([0.0, -9.81, 0.0]);
    free.settings = ClothSettings { integrator: still, time_step: TimeStep::default(), ..free.settings };
    assert!(Simulation::new(&free.setup(), Precision::F64).is_err(), "no step is stable");
}

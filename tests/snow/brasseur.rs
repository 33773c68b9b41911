//! The scene on which Brasseur 2014 ended, where particles burst over a very long distance; and a
//! small block dropped in the same frames, which a step of the wrong length breaks at once.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use nappe_scene::{NoMeshes, Scene, SceneLimits, shipped_scenes};
use nappe_sim::{
    collide::Contact, math::Precision, report::StepReport, snow::Preset, time_step::TimeStep,
    world::Simulation,
};
use nappe_tests::{
    scene::{difference, norm, positions},
    snow::{SnowScene, Variant, lattice, object, plane, step_once},
};

/// Runs frames and holds every one against what snow may do: energy falls, J_P stays in its range,
/// mass stays. Gives the last report and the greatest distance (m) of a particle from its start.
fn hold(simulation: &mut Simulation, frames: u64, slack: f64) -> (StepReport, f64) {
    let start = positions(simulation);
    let (mut energy, mut furthest) = (simulation.diagnose().total_energy(), 0.0_f64);
    let mut last = StepReport::default();

    for frame in 1..=frames {
        last = step_once(simulation);
        let now = last.diagnostics.total_energy();
        assert!(now <= energy + slack, "frame {frame}: {energy} J become {now} J");
        energy = now;
        let snow = last.snow.expect("there is snow");
        let [low, high] = snow.plastic_ratio_range;
        assert!(
            (0.6..=20.0).contains(&low) && (0.6..=20.0).contains(&high),
            "frame {frame}: J_P {low} to {high}"
        );
        assert!(snow.grid_mass_error.abs() < 1e-6, "frame {frame}: {:e} of the mass", snow.grid_mass_error);
        let moved = positions(simulation)
            .iter()
            .zip(&start)
            .map(|(x, y)| norm(difference(*x, *y)))
            .fold(0.0, f64::max);
        furthest = furthest.max(moved);
    }

    (last, furthest)
}

#[test]
fn the_scene_of_brasseur_2014_falls_and_comes_to_rest() {
    let (_, text) = shipped_scenes().iter().find(|(name, _)| *name == "brasseur").expect("it is shipped");
    let scene = Scene::parse(text, "brasseur").unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    let snow = built.setup.snow.as_ref().expect("there is snow");
    let count: usize = snow.objects.iter().map(|object| object.x.len()).sum();
    assert_eq!((count, snow.settings.cell, built.setup.dt), (4000, 0.1, 1.0 / 24.0));
    assert_eq!(snow.settings.time_step, TimeStep::default(), "the step is certified");
    let (mut simulation, _) = Simulation::new(&built.setup, Precision::F32).expect("a scene that is shipped");
    let start = simulation.diagnose().total_energy();
    let (last, furthest) = hold(&mut simulation, 120, 1e-7 * start);
    let kinetic = last.diagnostics.kinetic_energy;
    println!("at most {furthest:.2} m from its start, {kinetic:.2e} J of {start:.2e} J in motion after 5 s");
    assert!(furthest < 2.0, "a particle went {furthest} m");
    assert!(kinetic < 1e-3 * start, "{kinetic} J of {start} J are in motion after 5 s");
}

#[test]
fn a_block_dropped_in_frames_of_film_and_of_games_stays_together() {
    let snow = Preset::from_name("stomakhin").expect("a preset");
    for variant in Variant::all() {
        for dt in [1.0 / 24.0, 1.0 / 240.0] {
            let h = 0.025;
            let x = lattice([0.0, 2.0 * h, 0.0], [6; 3], [0.5 * h; 3]);
            let body = object("block", x, (0.5 * h).powi(3), snow.density, snow.material);
            let mut scene = SnowScene::new(vec![body], h, dt).by(variant).under([0.0, -9.81, 0.0]);
            scene.settings.time_step = TimeStep::default();
            scene.colliders = vec![plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, 0.5)];
            let scene = scene.moving(|_| [0.0, -2.0, 0.0]);
            let mut simulation = scene.simulate(Precision::F64);
            let start = simulation.diagnose().total_energy();
            let (_, furthest) = hold(&mut simulation, (0.125 / dt).round() as u64, 1e-3 * start);
            assert!(furthest < 0.3, "{}, dt = {dt} s: a particle went {furthest} m", variant.name());
        }
    }
}

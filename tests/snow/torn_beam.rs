//! A beam that sags under its own weight, and a cube that hangs: what holds is right, and what tears by numerics is told.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use nappe_sim::{
    collide::Contact,
    math::Precision,
    snow::{Kernel, Law, Transfer},
    time_step::TimeStep,
    world::Simulation,
};
use nappe_tests::{
    scene::advance,
    snow::{SnowScene, Variant, elastic, lattice, object, plane, with_law},
};

/// Side of a cell (m), and distance of particles.
const H: f64 = 0.125;
const SPACING: f64 = 0.5 * H;
const DENSITY: f64 = 1050.0;

/// Kernels and transfers whose C is an affine velocity.
fn affine() -> impl Iterator<Item = Variant> {
    [Kernel::Quadratic, Kernel::Cubic].into_iter().flat_map(|kernel| {
        [Transfer::Mls, Transfer::Apic].into_iter().map(move |transfer| Variant { kernel, transfer })
    })
}

/// A beam of 4 x 1 m, E 1e6 Pa, nu 0.3, in plane strain, that begins so deep (m) within a plane to which it sticks.
fn beam(variant: Variant, depth: f64) -> SnowScene {
    let counts = [4.0 + depth, 1.0, 4.0 * H].map(|side| (side / SPACING).round() as usize);
    let x = lattice([-depth, -0.5, 0.0], counts, [SPACING; 3]);
    let material = with_law(elastic(1e6, 0.3), Law::NeoHookean);
    let body = object("beam", x, SPACING.powi(3), DENSITY, material);
    let mut scene =
        SnowScene::new(vec![body], H, 0.005).by(variant).periodic([0, 0, 1]).under([0.0, -10.0, 0.0]);
    scene.settings.time_step = TimeStep::default();
    scene.colliders = vec![plane([0.0; 3], [1.0, 0.0, 0.0], Contact::Sticky, 0.0)];
    scene
}

/// How far the lower corner at the free end is above where it was (m).
fn corner(scene: &SnowScene, simulation: &Simulation) -> f64 {
    let particles = simulation.snow_particles();
    let ends = particles.iter().zip(&scene.objects[0].x);
    let low = ends.filter(|(_, x)| x[0] > 4.0 - SPACING && x[1] < SPACING - 0.5);
    let y: Vec<f64> =
        low.map(|(p, _)| p.x[1] + 0.5 * SPACING * (p.elastic[1][0] - p.elastic[1][1]) + 0.5).collect();
    y.iter().sum::<f64>() / y.len() as f64
}

/// How far from the plane the first row of particles is (m), at most.
fn farthest(scene: &SnowScene, simulation: &Simulation) -> f64 {
    let particles = simulation.snow_particles();
    let first = particles.iter().zip(&scene.objects[0].x).filter(|(_, x)| x[0] < SPACING);
    first.map(|(p, _)| p.x[0]).fold(0.0, f64::max)
}

#[test]
fn a_beam_within_its_clamp_sags_as_finite_elements_say() {
    for variant in affine() {
        let scene = beam(variant, 0.5);
        let mut simulation = scene.simulate(Precision::F64);
        let (mut lowest, mut time) = (0.0, 0.0);
        for step in 1..=260 {
            advance(&mut simulation, 1);
            let y = corner(&scene, &simulation);
            if y < lowest {
                (lowest, time) = (y, 0.005 * f64::from(step));
            }
        }
        println!("{}: {lowest:.3} m at {time:.3} s", variant.name());
        // Finite elements, CPDI and cpGIMP: -3.30 to -3.32 m at 1.05 to 1.07 s. Wider kernels are softer.
        assert!((lowest + 3.31).abs() < 0.02 * 3.31, "{}: {lowest} m", variant.name());
        assert!((time - 1.06).abs() < 0.03, "{}: at {time} s", variant.name());
    }
}

#[test]
fn a_beam_that_is_attached_sags_as_finite_elements_say() {
    for variant in affine() {
        let mut scene = beam(variant, 0.0);
        scene.objects[0].attach = Some(scene.colliders[0].name.clone());
        let mut simulation = scene.simulate(Precision::F64);
        let (mut lowest, mut time) = (0.0, 0.0);
        for step in 1..=220 {
            advance(&mut simulation, 1);
            let y = corner(&scene, &simulation);
            if y < lowest {
                (lowest, time) = (y, 0.005 * f64::from(step));
            }
        }
        let first = farthest(&scene, &simulation);
        println!("{}, attached: {lowest:.3} m at {time:.3} s, {first:.3} m off", variant.name());
        assert!((lowest + 3.31).abs() < 0.025 * 3.31, "{}: {lowest} m", variant.name());
        assert!(first < H, "{}: the first row is {first} m off", variant.name());
    }
}

#[test]
fn a_beam_that_only_touches_its_clamp_tears_and_that_is_told() {
    let mut torn = 0;
    for variant in affine() {
        let scene = beam(variant, 0.0);
        let mut simulation = scene.simulate(Precision::F64);
        let mut told = None;
        for step in 1..=320 {
            let report = advance(&mut simulation, 1);
            if told.is_none() && report.notices.torn_count > 0 {
                told = Some((0.005 * f64::from(step), report.notices.first_torn));
            }
        }
        let first = farthest(&scene, &simulation);
        println!("{}: told {told:?}, the first row is up to {first:.3} m off", variant.name());
        if first > 3.0 * H {
            torn += 1;
            let (time, particle) = told.expect("what tears is told");
            assert!(time < 1.2 && particle.is_some(), "{}: told at {time} s", variant.name());
        }
    }
    // Quadratic MLS is at the edge of it.
    assert!(torn >= 3, "{torn} of four tear");
}

#[test]
fn a_cube_that_hangs_is_told_to_tear_where_it_does() {
    for variant in affine() {
        for gravity in [50.0, 200.0, 300.0, 500.0] {
            let x = lattice([0.0, -1.0, 0.0], [16; 3], [SPACING; 3]);
            let body = object("cube", x, SPACING.powi(3), DENSITY, elastic(2e5, 0.0));
            let mut scene = SnowScene::new(vec![body], H, 0.002).by(variant).under([0.0, -gravity, 0.0]);
            scene.settings.time_step = TimeStep::default();
            scene.colliders = vec![plane([0.0; 3], [0.0, -1.0, 0.0], Contact::Sticky, 0.0)];
            let mut simulation = scene.simulate(Precision::F64);
            let told = (0..250).fold(0, |told, _| told + advance(&mut simulation, 1).notices.torn_count);
            let lowest = simulation.snow_particles().iter().map(|p| p.x[1]).fold(0.0, f64::min);
            println!("{}, {gravity} m/s²: lowest at {lowest:.2} m, told {told} times", variant.name());
            // A static stretch of rho g L / (2 E) in the middle, at most twice as much in the swing.
            let is_torn = lowest < -1.0 - 3.0 * DENSITY * gravity / 2e5;
            assert!(!is_torn || told > 0, "{}, {gravity} m/s²: torn, and not told", variant.name());
            assert!(gravity > 50.0 || (!is_torn && told == 0), "{}: stretched by 13 %", variant.name());
            assert!(gravity < 300.0 || told > 0, "{}: it hangs by what cells cannot bear", variant.name());
        }
    }
}

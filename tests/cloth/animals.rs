//! Cloth that falls on the course's cow, bunny and ball, which takes long.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use nappe_sim::{
    cloth::{SpringLaw, SpringRules},
    collide::Shape,
    linalg::SolverSettings,
    math::Precision,
};
use nappe_tests::{
    Scene, course,
    meshes::Surface,
    networks::sheet,
    scene::{advance, positions},
    threads::with_threads,
};

const MARGIN: f64 = 0.005;
/// Distance (m) below the margin that is rounding.
const ROUNDING: f64 = 1e-9;
const SIDE: usize = 70;
const SPACING: f64 = 0.02;
/// Steps of 5 ms: 3 s.
const STEPS: u64 = 600;
/// Steps between those whose distances are compared with those of all triangles, of every so many particles.
const COMPARED: u64 = 60;
const OF_PARTICLES: usize = 97;

/// A sheet of 1.4 m, flat and at rest, a little above what is 1 m high.
fn above() -> Scene {
    let law = |stiffness: f64| SpringLaw { stiffness, damping: 0.02 };
    let rules = SpringRules { stretch: law(100.0), shear: Some(law(30.0)), bend: Some(law(3.0)) };
    let mut network = sheet(SIDE, SPACING, &rules, 0.2 * SPACING * SPACING);
    let half = 0.5 * SPACING * (SIDE - 1) as f64;
    network.pins.clear();
    network.x.iter_mut().for_each(|x| *x = [x[0] - half, 1.0 + 2.0 * MARGIN, x[2] - half]);
    let mut scene = Scene::new(network, 5e-3).under([0.0, -9.81, 0.0]).certified();
    scene.settings.solver = SolverSettings::default();
    scene
}

fn falls_on_and_rests(test: &str, name: &str) {
    let Some(solid) = course::solid(test, name, 0.8, MARGIN) else { return };
    let Shape::Mesh(mesh) = &solid.shape else { panic!("{name} is a mesh") };
    let surface = Surface::of(mesh);
    let mut scene = above();
    scene.colliders = vec![solid.clone()];
    let mut simulation = scene.simulate(Precision::F64);
    let (mut fastest, mut last, mut touched, mut pinched) = (0.0_f64, 0.0, 0, 0);
    for step in 1..=STEPS {
        let report = advance(&mut simulation, 1);
        let notices = report.notices;
        assert_eq!(notices.passed_count, 0, "{name}, step {step}: first {:?}", notices.first_passed);
        let x = positions(&simulation);
        let distances: Vec<f64> = x.iter().map(|x| solid.distance(*x, 0.0).0).collect();
        let is_deep = |distance: &&f64| MARGIN - **distance > ROUNDING;
        let deep = distances.iter().filter(is_deep).count() as u64;
        let deepest = MARGIN - distances.iter().copied().fold(f64::INFINITY, f64::min);
        let counted = notices.pinched_count;
        assert!(
            deep <= counted,
            "{name}, step {step}: {deep} particles up to {deepest:e} m deep, {counted} pinched"
        );
        if step % COMPARED == 0 {
            for (i, x) in x.iter().enumerate().step_by(OF_PARTICLES) {
                let (distance, expected) = (distances[i], surface.distance(*x));
                let off = (distance - expected).abs();
                assert!(
                    off < 1e-12,
                    "{name}, step {step}, particle {i} at {x:?}: {distance}, not {expected}"
                );
            }
        }
        (last, touched) = (report.diagnostics.kinetic_energy, report.contact_count);
        fastest = fastest.max(last);
        pinched += counted;
    }
    println!("{name}: {touched} particles touch it at the end, {pinched} pinched over all steps");
    println!("{name}: kinetic energy {last:e} J at the end, {fastest:e} J at most");
    assert!(touched > 100, "{name}: {touched} particles touch it at the end");
    assert!(last < 0.01 * fastest, "{name}: {last:e} J at the end, {fastest:e} J at most: it does not rest");
}

#[test]
fn cloth_falls_on_a_cow_and_rests_and_no_particle_is_deeper_than_its_margin() {
    let test = "cloth_falls_on_a_cow_and_rests_and_no_particle_is_deeper_than_its_margin";
    with_threads(0, || falls_on_and_rests(test, "vache"));
}

#[test]
fn cloth_falls_on_a_bunny_and_rests_and_no_particle_is_deeper_than_its_margin() {
    let test = "cloth_falls_on_a_bunny_and_rests_and_no_particle_is_deeper_than_its_margin";
    with_threads(0, || falls_on_and_rests(test, "bunny"));
}

#[test]
fn cloth_falls_on_a_ball_of_the_course_and_rests_and_no_particle_is_deeper_than_its_margin() {
    let test = "cloth_falls_on_a_ball_of_the_course_and_rests_and_no_particle_is_deeper_than_its_margin";
    with_threads(0, || falls_on_and_rests(test, "sphere"));
}

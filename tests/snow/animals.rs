//! A snowball that is thrown at the course's cow, which takes long.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use nappe_sim::{math::Precision, snow::Preset, time_step::TimeStep};
use nappe_tests::{
    course,
    snow::{SnowScene, ball, object, step_once},
    threads::with_threads,
};

/// Side of a cell (m).
const H: f64 = 0.03;

fn hits_the_cow(test: &str) {
    let Some(cow) = course::solid(test, "vache", 0.6, 0.0) else { return };
    let snow = Preset::from_name("stomakhin").expect("a preset");
    // At its flank: the cow is half as wide along x as it is high.
    let x = ball([0.55, 0.62, 0.0], 0.15, 0.5 * H);
    let mut thrown = object("ball", x, (0.5 * H).powi(3), snow.density, snow.material);
    thrown.v.fill([-9.0, 0.5, 0.3]);
    let mut scene = SnowScene::new(vec![thrown], H, 0.01).under([0.0, -9.81, 0.0]);
    scene.settings.time_step = TimeStep::default();
    scene.colliders = vec![cow.clone()];
    let mut simulation = scene.simulate(Precision::F64);
    let (mut deepest, mut near, mut passed) = (f64::NEG_INFINITY, 0, 0);
    for step in 1..=80 {
        passed += step_once(&mut simulation).notices.passed_count;
        let particles = simulation.snow_particles();
        let distances: Vec<f64> = particles.iter().map(|p| cow.distance(p.x, 0.0).0).collect();
        for (i, distance) in distances.iter().enumerate() {
            let (x, v) = (particles[i].x, particles[i].v);
            assert!(*distance > -H, "step {step}, particle {i} at {x:?} with {v:?}: {distance} m");
        }
        near = distances.iter().filter(|distance| **distance < H).count().max(near);
        deepest = distances.iter().map(|distance| -distance).fold(deepest, f64::max);
    }
    println!("snowball at a cow: {deepest:.4} m deep at most, cells of {H} m, {passed} particles passed");
    assert!(near > 100, "{near} particles came near the cow at once");
}

#[test]
fn no_particle_of_a_snowball_at_a_cow_is_deeper_than_a_cell() {
    let test = "no_particle_of_a_snowball_at_a_cow_is_deeper_than_a_cell";
    with_threads(0, || hits_the_cow(test));
}

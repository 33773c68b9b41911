//! A hand that takes cloths of shipped scenes at random places and draws them about.

#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use nappe_scene::{NoMeshes, Scene, SceneLimits, shipped_scenes};
use nappe_sim::{
    report::NoStopwatch,
    world::{Change, Pull, Simulation},
};
use nappe_tests::{
    Random,
    scene::{difference, norm, positions},
    threads::on_one_thread,
};

/// Particles that a hand takes at most, and the share of the body's extent within which it does.
const PATCH: (usize, f64) = (48, 0.03);
/// How long a hand draws, and how long it rests then (s).
const DRAWN: f64 = 0.45;
/// Acceleration of gravity (m/s²).
const GRAVITY: f64 = 9.81;

/// Draws the first body of a shipped scene at so many random places by up to 5 m/s, with three times its weight at most: no
/// step fails, no spring is longer than the scene allows, and below a hundredth of the sub-steps is rejected.
///
/// # Panics
/// When that is not so.
pub(crate) fn random_pulls_fail_nothing(name: &str, count: u32) {
    let (_, text) = shipped_scenes().iter().find(|(n, _)| *n == name).expect("a scene of that name");
    let scene = Scene::parse(text, name).unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    let body = &built.setup.bodies[0];
    let (mut simulation, _) =
        Simulation::new(&built.setup, scene.precision).expect("a scene that is shipped");
    simulation.apply(&built.initial_changes).expect("changes of a scene that is shipped");

    let steps = (DRAWN / built.setup.dt).round() as u32;
    let (mut taken, mut rejected, mut longest) = (0, 0, 0.0_f64);
    let mut random = Random::seeded(84);
    for number in 0..count {
        let x = positions(&simulation)[..body.network.x.len()].to_vec();
        let patch = patch(&x, &body.network.pins, &mut random);
        let (heading, speed) = (random.direction(), random.between(0.5, 5.0));
        for step in 0..2 * steps {
            // A hand is renewed every 20 ms, and its last pull ends by itself.
            if step < steps && step % 4 == 0 {
                let along = (speed * built.setup.dt * f64::from(step)).min(0.75);
                let change = pull(&body.name, &patch, &x, heading.map(|c| along * c), built.setup.dt);
                simulation.apply(&[change]).expect("a fair pull");
            }
            let report = on_one_thread(|| simulation.step(&mut NoStopwatch))
                .unwrap_or_else(|error| panic!("{name}, pull {number}, step {step}: {error}"));
            let cloth = report.cloth.expect("a cloth");
            (taken, rejected) = (taken + cloth.substeps, rejected + cloth.rejected);
            longest = longest.max(report.diagnostics.max_stretch);
        }
    }
    println!("{name}: {count} pulls, {taken} sub-steps, {rejected} rejected, stretch {longest:.3}");
    let limit = body.settings.limits.max_stretch.unwrap_or(f64::INFINITY);
    assert!(longest < limit, "{name}: {longest} of {limit}");
    assert!(100 * rejected < taken, "{name}: {rejected} of {taken} sub-steps rejected");
}

/// The particles nearest to a random one that is not pinned.
fn patch(x: &[[f64; 3]], pins: &[u32], random: &mut Random) -> Vec<u32> {
    let free: Vec<u32> = (0..x.len() as u32).filter(|particle| !pins.contains(particle)).collect();
    let middle = x[random.pick(&free) as usize];
    let far = |particle: u32| norm(difference(x[particle as usize], middle));
    let (most, share) = PATCH;
    let reach = share * extent(x);
    let mut near: Vec<u32> = free.iter().copied().filter(|particle| far(*particle) <= reach).collect();
    near.sort_by(|a, b| far(*a).total_cmp(&far(*b)));
    near.truncate(most);
    near
}

/// The longest side of the box that holds points (m).
fn extent(x: &[[f64; 3]]) -> f64 {
    let sides = [0, 1, 2].map(|c| {
        let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| {
            (low.min(point[c]), high.max(point[c]))
        });
        high - low
    });
    sides.into_iter().fold(0.0, f64::max)
}

/// Draws particles away from where they were, in steps of `dt` (s).
fn pull(body: &str, patch: &[u32], x: &[[f64; 3]], by: [f64; 3], dt: f64) -> Change {
    let points = patch.iter().map(|particle| {
        let place = x[*particle as usize];
        [0, 1, 2].map(|c| place[c] + by[c])
    });
    let most = 3.0 * GRAVITY * x.len() as f64 / patch.len() as f64;
    let frequency = (10.0 * most / extent(x)).sqrt().min(Pull::frequencies(dt)[1]);
    Change::Pull(Pull {
        body: body.to_owned(),
        particles: patch.into(),
        points: points.collect(),
        frequency,
        most,
        seconds: 0.5,
    })
}

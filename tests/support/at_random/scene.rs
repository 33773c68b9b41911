//! A scene of a seed.

use std::collections::BTreeMap;

use nappe_scene::{Scene, WindKey};
use nappe_sim::math::Precision;

use super::{Case, body, body::Scale, collider, snow};
use crate::Random;

/// The scene of a seed.
pub fn of_seed(seed: u64) -> Case {
    let random = &mut Random::seeded(seed);
    let dt = random.decades(1e-4, 5e-2);
    let steps = random.decades(2.0, 60.0) as u64;
    let precision = random.pick(&[Precision::F64, Precision::F64, Precision::F32]);
    let mut scene = Scene { dt, steps, precision, title: format!("seed {seed}"), ..Scene::default() };
    scene.gravity = match random.whole(0, 3) {
        0 => [0.0; 3],
        1 => random.direction().map(|c| 9.81 * c),
        _ => scene.gravity,
    };
    if random.chance(0.2) {
        scene.wind = random.vector().map(|c| 5.0 * c);
    } else if random.chance(0.05) {
        let velocity = |random: &mut Random| random.vector().map(|c| 5.0 * c);
        let end = dt * steps as f64;
        scene.wind_at = [0.0, 0.5 * end].map(|time| WindKey { time, velocity: velocity(random) }).to_vec();
    }
    let mut case = Case { scene, meshes: BTreeMap::new() };
    let size = if random.chance(0.3) {
        case.scene.dt = dt.min(5e-3);
        snow::add(random, &mut case)
    } else {
        let scale = Scale { spacing: random.decades(0.005, 0.5), dt };
        let bodies = random.pick(&[1, 1, 1, 2, 3]);
        (0..bodies).for_each(|number| body::add(random, &mut case, scale, number));
        6.0 * scale.spacing
    };
    let colliders = random.pick(&[0, 0, 1, 1, 2, 3]);
    (0..colliders).for_each(|number| {
        let dt = case.scene.dt;
        collider::add(random, &mut case, [size, dt], number);
    });
    case
}

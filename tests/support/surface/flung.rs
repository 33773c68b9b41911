//! A sheet that is flung about in a box without a lid, in waves that cross each other.

use nappe_sim::collide::Collider;

use super::scenes::{Case, floor, scene, wall};
use crate::{Random, Scene, numbering::renumbered, sheets::Sheet};

/// Distance between neighbours (m).
const SPACING: f64 = 0.02;

/// A box of walls around a place where a sheet of `side` x `side` particles just fits.
fn flung_box(side: usize, margin: f64) -> Vec<Collider> {
    let half = 0.5 * SPACING * side as f64 + 0.05;
    let upright =
        |name: &str, x: f64, z: f64| wall(name, [-half * x, 0.0, -half * z], [x, 0.0, z], 0.3, margin);
    let sides = [("left", 1.0, 0.0), ("right", -1.0, 0.0), ("back", 0.0, 1.0), ("front", 0.0, -1.0)];
    let walls = sides.into_iter().map(|(name, x, z)| upright(name, x, z));
    [floor(0.0, 0.3, margin)].into_iter().chain(walls).collect()
}

/// A sheet of `side` x `side` particles half a metre above the floor of its box, thrown at up to 6 m/s, so that it folds within a
/// few steps: in another way for each seed.
pub fn flung(side: usize, thickness: f64, seed: u64, case: &Case) -> Scene {
    let sheet = Sheet { ripple: 1e-3, ..Sheet::level(side, SPACING, [0.0, 0.5, 0.0], 0.0) };
    let mut network = sheet.network();
    let mut random = Random::seeded(seed);
    for (speed, longest) in [(2.1, 0.4), (1.4, 1.2)] {
        // Radians from neighbour to neighbour, along rows and from row to row, for each component.
        let waves = [0, 1, 2].map(|_| [0, 1].map(|_| longest * random.number()));
        let phases = random.vector().map(|share| std::f64::consts::PI * share);
        for (i, v) in network.v.iter_mut().enumerate() {
            let (c, r) = ((i % side) as f64, (i / side) as f64);
            for k in 0..3 {
                v[k] += speed * (waves[k][0] * c + waves[k][1] * r + phases[k]).sin();
            }
        }
    }

    let network = renumbered(&network, &case.numbering.of(network.x.len()));
    let mut scene = scene(network, thickness, case.friction);
    scene.colliders = flung_box(side, thickness);
    scene
}

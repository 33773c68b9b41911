//! Sheets one above the other: a pile on a floor, and sheets that fall on a ball.

use nappe_sim::{cloth::Network, collide::Collider, world::WorldSetup};

use super::{
    bodies::of_bodies,
    scenes::{Case, ball, floor, scene},
};
use crate::{
    Scene,
    numbering::renumbered,
    sheets::{Sheet, together},
};

/// Level sheets of `side` x `side` particles, one above the other: the first `lowest` m high, `apart` m from one
/// to the next. They are turned by 0, 1 or 2 times an angle (rad) and shifted a little, so that no particle is above another.
fn stack(
    [count, side]: [usize; 2],
    spacing: f64,
    [lowest, apart]: [f64; 2],
    turn: f64,
    ripple: f64,
) -> Vec<Network> {
    let sheet = |layer: usize| {
        let shift = [0.0013 * (layer % 4) as f64, 0.0017 * (layer % 3) as f64];
        let middle = [shift[0], lowest + apart * layer as f64, shift[1]];
        Sheet { ripple, ..Sheet::level(side, spacing, middle, turn * (layer % 3) as f64) }.network()
    };
    (0..count).map(sheet).collect()
}

/// A pile of so many sheets of `side` x `side` particles, 1 cm apart, just above a floor.
pub fn piled([count, side]: [usize; 2], thickness: f64, case: &Case) -> Scene {
    let network = together(&stack([count, side], 0.01, [1.5 * thickness, 1.5 * thickness], 0.03, 0.0));
    let network = renumbered(&network, &case.numbering.of(network.x.len()));
    let mut scene = scene(network, thickness, case.friction);
    scene.colliders = vec![floor(0.0, 0.3, 0.5 * thickness)];
    scene
}

/// So many sheets of `side` x `side` particles, so far (m) from one to the next, that fall on a ball of a radius (m) and slide to
/// the floor that it stands on.
pub fn on_a_ball(
    [count, side]: [usize; 2],
    [spacing, radius]: [f64; 2],
    thickness: f64,
    case: &Case,
) -> Scene {
    let network = together(&stack([count, side], spacing, [2.0 * radius + 0.02, 0.03], 0.1, 2e-4));
    let network = renumbered(&network, &case.numbering.of(network.x.len()));
    let mut scene = scene(network, thickness, case.friction);
    scene.colliders = ball_on_a_floor(radius, 0.5 * thickness);
    scene
}

/// The same with a body for each of three sheets.
pub fn bodies_on_a_ball(side: usize, [spacing, radius]: [f64; 2], thickness: f64, case: &Case) -> WorldSetup {
    let mut scene = scene(Network::default(), 0.0, case.friction);
    scene.colliders = ball_on_a_floor(radius, 0.5 * thickness);
    let sheets = stack([3, side], spacing, [2.0 * radius + 0.02, 0.03], 0.1, 2e-4);
    let sheets = sheets.iter().map(|sheet| renumbered(sheet, &case.numbering.of(sheet.x.len())));
    let names = ["lowest", "middle", "highest"];
    of_bodies(&scene, names.into_iter().zip(sheets).map(|(name, sheet)| (name, sheet, thickness)).collect())
}

fn ball_on_a_floor(radius: f64, margin: f64) -> Vec<Collider> {
    vec![ball([0.0, radius, 0.0], radius, 0.3, margin + 1e-3), floor(0.0, 0.3, margin)]
}

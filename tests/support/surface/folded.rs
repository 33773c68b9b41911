//! A towel that pins fold twice on a floor, and let go.

use std::f64::consts::PI;

use nappe_sim::world::Change;

use super::{
    scenes::{Case, DT, floor, scene},
    tally::{Tally, Watched},
};
use crate::{numbering::renumbered, scene::positions, sheets::Sheet};

/// A towel, and how fast it is folded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Folds {
    /// Particles along a side.
    pub side: usize,
    /// Distance between neighbours (m).
    pub spacing: f64,
    /// What its surfaces keep (m); 0: nothing.
    pub thickness: f64,
    /// Steps of a fold, of the rest after each, and of the rest after pins let go.
    pub steps: [u64; 3],
}

/// Folds a towel along one axis, lets go, folds it along the other, lets go.
pub fn folded_twice(folds: &Folds, case: &Case) -> Tally {
    let &Folds { side, spacing, thickness, steps: [folding, resting, letting_go] } = folds;
    let margin = (0.5 * thickness).max(1e-3);
    let flat = Sheet::level(side, spacing, [0.0, margin + 1e-4, 0.0], 0.0).network();
    let to = case.numbering.of(flat.x.len());
    let flat = renumbered(&flat, &to);
    let with_pins = |pins: &[u32]| {
        let mut network = flat.clone();
        network.pins = pins.to_vec();
        let mut scene = scene(network, thickness, case.friction);
        scene.colliders = vec![floor(0.0, 0.5, margin)];
        scene
    };
    let column: Vec<u32> = (0..side).map(|r| to[r * side + side - 1] as u32).collect();
    let row: Vec<u32> = (0..side).map(|c| to[(side - 1) * side + c] as u32).collect();

    // Pins come to lie this much higher than what they lie on.
    let clearance = 1.5 * thickness.max(1e-3);
    let mut watched = Watched::new(&with_pins(&column), case.precision);
    fold(&mut watched, 0, &column, clearance, folding);
    watched.go(folding + resting);
    let mut watched = watched.in_scene(&with_pins(&row));
    watched.go(resting);
    fold(&mut watched, 2, &row, clearance, folding);
    watched.go(folding + resting);
    let mut watched = watched.in_scene(&with_pins(&[]));
    watched.go(letting_go);
    watched.tally
}

/// Sends pins over the middle of the cloth along an axis, in half a circle, and a tenth of its length back.
fn fold(watched: &mut Watched, axis: usize, pins: &[u32], clearance: f64, steps: u64) {
    let x = positions(&watched.simulation);
    let end = |c: usize, least: fn(f64, f64) -> f64, from: f64| x.iter().map(|p| p[c]).fold(from, least);
    let [low, high] = [end(axis, f64::min, f64::INFINITY), end(axis, f64::max, f64::NEG_INFINITY)];
    let middle = f64::midpoint(low, high);
    let height = end(1, f64::max, f64::NEG_INFINITY) + clearance;
    let way = |pin: &u32| {
        let start = x[*pin as usize];
        let [out, up] = [start[axis] - middle, start[1] - height];
        let point = |step: u64| {
            let share = step as f64 / steps as f64;
            let (sin, cos) = (PI * share).sin_cos();
            let mut place = start;
            place[axis] = middle + out * cos - up * sin + 0.1 * (high - low) * share;
            place[1] = height + out * sin + up * cos;
            (step as f64 * DT, place)
        };
        Change::PinPath { particle: *pin, points: (1..=steps).map(point).collect() }
    };
    let changes: Vec<Change> = pins.iter().map(way).collect();
    watched.simulation.apply(&changes).unwrap_or_else(|error| panic!("refused: {error}"));
}

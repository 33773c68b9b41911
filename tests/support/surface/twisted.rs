//! A sheet between two rows of pins that turn against each other.

use std::f64::consts::PI;

use nappe_sim::world::Change;

use super::{
    scenes::{Case, DT, scene},
    tally::Watched,
};
use crate::{numbering::renumbered, scene::positions, sheets::Sheet};

/// A sheet of `side` x `side` particles, so far (m) from one to the next, whose ends turn by so many turns against each other
/// within so many steps, and come nearer by 30 %. There is no gravity. It stands before its first step.
pub fn twisted(side: usize, spacing: f64, thickness: f64, [turns, steps]: [u32; 2], case: &Case) -> Watched {
    let flat = Sheet { ripple: 5e-4, ..Sheet::upright(side, spacing) }.network();
    let to = case.numbering.of(flat.x.len());
    let mut network = renumbered(&flat, &to);
    let ends = [0..side, side * (side - 1)..side * side];
    network.pins = ends.iter().cloned().flatten().map(|i| to[i] as u32).collect();
    let scene = scene(network, thickness, case.friction).under([0.0; 3]);
    let mut watched = Watched::new(&scene, case.precision);

    let x = positions(&watched.simulation);
    let length = spacing * (side - 1) as f64;
    let way = |particle: u32, sign: f64| {
        let [px, py, pz] = x[particle as usize];
        let point = |step: u32| {
            let share = f64::from(step) / f64::from(steps);
            // Half of the turns at each end.
            let (sin, cos) = (sign * PI * f64::from(turns) * share).sin_cos();
            let place = [cos * px - sin * pz, py - sign * 0.15 * length * share, sin * px + cos * pz];
            (f64::from(step) * DT, place)
        };
        Change::PinPath { particle, points: (1..=steps).map(point).collect() }
    };
    let changes: Vec<Change> = ends
        .into_iter()
        .zip([1.0, -1.0])
        .flat_map(|(end, sign)| end.map(move |i| (i, sign)))
        .map(|(i, sign)| way(to[i] as u32, sign))
        .collect();
    watched.simulation.apply(&changes).unwrap_or_else(|error| panic!("refused: {error}"));
    watched
}

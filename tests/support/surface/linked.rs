//! Two rings of cloth, one through the other: the upper one is held, the lower one hangs in it.

use super::{
    scenes::{Case, scene},
    tally::Watched,
};
use crate::{
    crossings::linking,
    numbering::renumbered,
    scene::positions,
    sheets::{band, together},
};

/// Rings of so many particles around and across.
const SIZE: [usize; 2] = [40, 5];

/// Distance between neighbours (m).
const SPACING: f64 = 0.012;

/// Rings, and how they are watched.
#[derive(Clone, Debug)]
pub struct Rings {
    /// Both in one simulation, whose steps are counted.
    pub watched: Watched,
    /// Particles along the middle of each.
    middles: [Vec<usize>; 2],
}

impl Rings {
    /// How often they are linked now.
    pub fn links(&self) -> i64 {
        let x = positions(&self.watched.simulation);
        let line = |middle: &[usize]| middle.iter().map(|i| x[*i]).collect::<Vec<_>>();
        linking(&line(&self.middles[0]), &line(&self.middles[1]))
    }

    /// Mean height (m) of each.
    pub fn heights(&self) -> [f64; 2] {
        let x = positions(&self.watched.simulation);
        [0, 1].map(|ring: usize| {
            let middle = &self.middles[ring];
            middle.iter().map(|i| x[*i][1]).sum::<f64>() / middle.len() as f64
        })
    }
}

/// Rings that keep a thickness (m), before their first step.
pub fn linked_rings(thickness: f64, case: &Case) -> Rings {
    let radius = SPACING * SIZE[0] as f64 / std::f64::consts::TAU;
    // The lower one goes through the middle of the upper one.
    // Turned a little, so that no particle lies in the plane of the other ring.
    let upper = |angle: f64, along: f64| {
        let (sin, cos) = (angle + 0.07).sin_cos();
        [radius * sin, radius * cos, along]
    };
    let lower = |angle: f64, along: f64| [along, radius * (angle.cos() - 1.0), radius * angle.sin()];
    let density = 0.25;
    let both = together(&[band(SIZE, SPACING, upper, density), band(SIZE, SPACING, lower, density)]);
    let to = case.numbering.of(both.x.len());
    let [around, across] = SIZE;
    let mut network = renumbered(&both, &to);
    network.pins = (0..2 * across).map(|i| to[i] as u32).collect();

    let count = around * across;
    let middle = |first: usize| (0..around).map(|i| to[first + i * across + across / 2]).collect();
    let watched = Watched::new(&scene(network, thickness, case.friction), case.precision);
    Rings { watched, middles: [middle(0), middle(count)] }
}

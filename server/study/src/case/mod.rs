//! What is studied: the cloths of a scene as it is written, or its snow where it has no cloth, and distances between their states.

mod times;
mod measure;
mod common;

pub use common::CommonPoints;
pub use measure::{Measure, NoMeasure};
pub use times::{Times, TimesError};

use nappe_sim::{
    cloth::{Network, RestSettings},
    math::Precision,
    world::{Change, WorldSetup},
};
use thiserror::Error;

/// The cloths of a scene, or its snow.
#[derive(Clone, Debug)]
pub struct Case {
    /// What the scene is called.
    pub name: String,
    /// How it is stepped as it is written.
    pub precision: Precision,
    pub(crate) setup: WorldSetup,
    /// Changes before the first step.
    pub(crate) changes: Vec<Change>,
    /// Mass (kg) of each particle, 0 for pins.
    masses: Vec<f64>,
    /// The first particle of each body, and the end.
    bounds: Vec<usize>,
    /// What of it is compared.
    measure: Measure,
}

/// Nothing to be studied.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{0} has neither cloth nor snow; methods of one of them are compared")]
pub struct NothingToStudy(pub String);

impl Case {
    /// The cloths of a world, which begins with some changes: snow beside them is left out. Or the snow, where there is none. Nothing sleeps:
    /// methods are compared by all of their steps.
    ///
    /// # Errors
    /// A world without either.
    pub fn new(
        name: &str,
        mut setup: WorldSetup,
        changes: Vec<Change>,
        precision: Precision,
    ) -> Result<Self, NothingToStudy> {
        setup.bodies.iter_mut().for_each(|body| body.settings.rest = None);
        let of_bodies: Vec<Vec<f64>> = match &setup.snow {
            Some(snow) if setup.bodies.is_empty() => {
                snow.objects.iter().map(|object| object.mass.clone()).collect()
            }
            _ if setup.bodies.is_empty() => return Err(NothingToStudy(name.to_owned())),
            _ => {
                setup.snow = None;
                setup.bodies.iter().map(|body| masses(&body.network)).collect()
            }
        };
        let ends = of_bodies.iter().scan(0, |end, masses| {
            *end += masses.len();
            Some(*end)
        });
        let bounds = std::iter::once(0).chain(ends).collect();
        let masses = of_bodies.concat();
        let measure = Measure::default();
        Ok(Self { name: name.to_owned(), precision, setup, changes, masses, bounds, measure })
    }

    /// Whether it is snow, and not cloth.
    pub const fn is_snow(&self) -> bool {
        self.setup.snow.is_some()
    }

    /// What of it is compared: its motion, if nothing else was asked for.
    pub const fn measure(&self) -> &Measure {
        &self.measure
    }

    /// The same, of which something else is compared.
    ///
    /// # Errors
    /// What it does not have: a weight, along which heights are told, or a particle.
    pub fn measuring(self, measure: Measure) -> Result<Self, NoMeasure> {
        let is_height = matches!(measure, Measure::Energy | Measure::Sag);
        if is_height && self.weight() == 0.0 {
            return Err(NoMeasure::NoWeight);
        }
        let count = self.particle_count();
        if let Measure::Coordinate { particle, axis, .. } = measure
            && (particle >= count || axis >= Measure::AXES.len())
        {
            return Err(NoMeasure::NoCoordinate { particle, axis, count });
        }
        Ok(Self { measure, ..self })
    }

    /// The cloths: their names, the places of their first particles, and what they are made of.
    pub fn cloths(&self) -> impl Iterator<Item = (&str, usize, &Network)> {
        let bodies = self.setup.bodies.iter().zip(&self.bounds);
        bodies.map(|(body, first)| (body.name.as_str(), *first, &body.network))
    }

    /// Time step of the world as it is written (s).
    pub fn dt(&self) -> f64 {
        self.setup.dt
    }

    /// Whether pins move: steps of the world are then the scene's own, which pins are sent in.
    pub fn has_moving_pins(&self) -> bool {
        self.changes.iter().any(|change| matches!(change, Change::Pin { .. } | Change::PinPath { .. }))
    }

    /// Whether a cloth has a thickness: surfaces are kept apart by implicit Euler alone, in steps that are checked.
    pub fn is_thick(&self) -> bool {
        self.setup.bodies.iter().any(|body| body.network.thickness > 0.0)
    }

    /// Number of particles.
    pub fn particle_count(&self) -> usize {
        self.masses.len()
    }

    /// Whether a particle is free, and no pin; none of one that is not there.
    pub(crate) fn is_free(&self, particle: usize) -> Option<bool> {
        self.masses.get(particle).map(|mass| *mass > 0.0)
    }

    /// Length (m) of the diagonal of the box in which all particles start.
    pub fn diagonal(&self) -> f64 {
        self.extents().iter().map(|extent| extent * extent).sum::<f64>().sqrt()
    }

    /// How long (m) the box is along each axis in which all particles start.
    pub fn extents(&self) -> [f64; 3] {
        let snow = || self.setup.snow.iter().flat_map(|snow| &snow.objects);
        let cloth = || self.setup.bodies.iter().flat_map(|body| &body.network.x);
        let x = || cloth().chain(snow().flat_map(|object| &object.x));
        [0, 1, 2].map(|axis| {
            let low = x().map(|x| x[axis]).fold(f64::INFINITY, f64::min);
            x().map(|x| x[axis]).fold(f64::NEG_INFINITY, f64::max) - low
        })
    }

    /// Root of the mean square over free particles of how far they are (m) in one state from where they are in another.
    pub fn rms(&self, a: &[f64], b: &[f64]) -> f64 {
        let mut sum = 0.0;
        let mut count = 0;
        for (i, _) in self.masses.iter().enumerate().filter(|(_, mass)| **mass > 0.0) {
            sum += (3 * i..3 * i + 3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
            count += 1;
        }
        if count == 0 { 0.0 } else { (sum / f64::from(count)).sqrt() }
    }

    /// What is compared of a state with these positions (m) and this total energy (J): the positions, or the number (m) that is
    /// measured.
    pub(crate) fn observed(&self, positions: Vec<f64>, energy: f64) -> Vec<f64> {
        match &self.measure {
            Measure::Motion | Measure::End => positions,
            Measure::Energy => vec![energy / self.weight()],
            Measure::Sag => vec![self.sag(&positions)],
            Measure::Coordinate { particle, axis, .. } => vec![positions[3 * particle + axis]],
        }
    }

    /// How far (m) what is compared of one state is from what is compared of another.
    pub fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        if self.measure.is_of_positions() { self.rms(a, b) } else { (a[0] - b[0]).abs() }
    }

    /// The size of gravity (m/s²).
    fn pull(&self) -> f64 {
        self.setup.gravity.iter().map(|g| g * g).sum::<f64>().sqrt()
    }

    /// The weight (N) of all that is free.
    fn weight(&self) -> f64 {
        self.pull() * self.masses.iter().sum::<f64>()
    }

    /// How far (m) the lowest of some particles lies below the highest, along gravity.
    fn sag(&self, positions: &[f64]) -> f64 {
        let depth = |x: &[f64]| x.iter().zip(&self.setup.gravity).map(|(x, g)| x * g).sum::<f64>();
        let depths = positions.chunks_exact(3).map(depth);
        let [least, most] = depths.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], depth| {
            [f64::min(least, depth), f64::max(most, depth)]
        });
        (most - least) / self.pull()
    }

    /// How far (m) the centre of mass of the free particles of a body is in one state from where it is in another: the
    /// largest over bodies.
    pub fn centre_distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let of_body = |range: &[usize]| {
            let particles = range[0]..range[1];
            let mass: f64 = self.masses[particles.clone()].iter().sum();
            let moment = |axis: usize| {
                particles.clone().map(|i| self.masses[i] * (a[3 * i + axis] - b[3 * i + axis])).sum::<f64>()
            };
            let squares = [0, 1, 2].map(moment).iter().map(|moment| moment * moment).sum::<f64>();
            if mass > 0.0 { squares.sqrt() / mass } else { 0.0 }
        };
        self.bounds.windows(2).map(of_body).fold(0.0, f64::max)
    }

    /// The same, in which what lies still sleeps, as these settings allow.
    pub(crate) fn resting(&self, rest: RestSettings) -> Self {
        let mut resting = self.clone();
        resting.setup.bodies.iter_mut().for_each(|body| body.settings.rest = Some(rest));
        resting
    }

    /// The same with each free particle displaced by `distance` (m), in directions at random.
    pub(crate) fn displaced(&self, distance: f64, rng: &mut fastrand::Rng) -> Self {
        let mut moved = self.clone();
        let positions = moved.setup.bodies.iter_mut().flat_map(|body| &mut body.network.x);
        for (x, _) in positions.zip(&self.masses).filter(|(_, mass)| **mass > 0.0) {
            let way = direction(rng);
            *x = [0, 1, 2].map(|c| x[c] + distance * way[c]);
        }
        moved
    }
}

/// Masses (kg), 0 for pins.
pub(crate) fn masses(network: &Network) -> Vec<f64> {
    let mut masses = network.masses.clone();
    network.pins.iter().for_each(|pin| masses[*pin as usize] = 0.0);
    masses
}

/// A direction, all alike.
pub(crate) fn direction(rng: &mut fastrand::Rng) -> [f64; 3] {
    loop {
        let v = [0, 1, 2].map(|_| 2.0 * rng.f64() - 1.0);
        let square: f64 = v.iter().map(|c| c * c).sum();
        if (1e-6..=1.0).contains(&square) {
            return v.map(|c| c / square.sqrt());
        }
    }
}

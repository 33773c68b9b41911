//! The scene seen from a train: all velocities, pins, colliders and the wind have one velocity more. What moves within it is the same.
//!
//! Snow is left out: its grid stands still.

use nappe_sim::{
    cloth::Minimizer,
    collide::{Pose, PoseKey},
    linalg::Stop,
    math::Precision,
    snow::Integration,
    world::Change,
};
use nappe_tests::at_random::World;

use crate::law::{Law, Verdict, WORK, alike, shaken, spread};

pub(crate) const LAW: Law = Law { name: "boost", judge };

/// The velocity of the train (m/s).
const TRAIN: [f64; 3] = [24.0, -7.0, 16.0];
/// Share of the size that is allowed.
const ALLOWED: f64 = 1e-9;
/// How many times as far as a scene that is shaken by rounding one may come.
const SPREADS: f64 = 1e4;

fn judge(world: &World) -> Result<Verdict, String> {
    if world.setup.snow.is_some() {
        return Ok(Verdict::Silent);
    }
    compare(&tight(world), TRAIN)
}

/// Whether a world does the same seen from a train with that velocity (m/s).
pub(crate) fn compare(still: &World, train: [f64; 3]) -> Result<Verdict, String> {
    // Keys and pins go on as long as the whole scene.
    let (world, first) = still.run_within(WORK)?;
    let second = World { steps: world.steps, ..boosted(still, train) }.run()?;
    let rounding = 1e-15 * (30.0 + world.size() / world.setup.dt);
    let spread = spread(&first, &shaken(&world, rounding).run()?);
    let allowed = |step: usize| {
        ALLOWED * world.size() + SPREADS * spread.get(step).or(spread.last()).copied().unwrap_or_default()
    };
    let at = |step: usize| train.map(|c| c * world.setup.dt * step as f64);
    Ok(alike(&first, &second, at, allowed))
}

/// In binary64, with solves that end at rounding, and pins that never stop on their way.
pub(crate) fn tight(world: &World) -> World {
    let mut tight = world.clone();
    tight.precision = Precision::F64;
    let end = world.duration();
    for body in &mut tight.setup.bodies {
        if matches!(body.settings.solver.stop, Stop::Residual { .. }) {
            body.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 4000 };
        }
        if let Minimizer::Newton(newton) = &mut body.settings.minimizer {
            newton.tolerance = 1e-8;
        }
    }
    tighten_snow(&mut tight);
    for change in &mut tight.changes {
        if let Change::Pin { duration, .. } = change {
            *duration = end;
        }
    }
    tight
}

/// Has semi-implicit snow end its solves at rounding.
pub(crate) fn tighten_snow(world: &mut World) {
    let tolerance = if world.precision == Precision::F64 { 1e-13 } else { 1e-6 };
    if let Some(snow) = &mut world.setup.snow
        && let Integration::SemiImplicit { stop, .. } = &mut snow.settings.integration
    {
        *stop = Stop::Residual { tolerance, max_iterations: 4000 };
    }
}

/// The same from a train with that velocity (m/s).
pub(crate) fn boosted(world: &World, train: [f64; 3]) -> World {
    let mut boosted = world.clone();
    let end = world.duration();
    let plus = |v: [f64; 3], time: f64| [0, 1, 2].map(|c| v[c] + train[c] * time);
    let setup = &mut boosted.setup;
    setup.wind = plus(setup.wind, 1.0);
    setup.wind_at.iter_mut().for_each(|(_, v)| *v = plus(*v, 1.0));
    let mut first = 0;
    for body in &mut setup.bodies {
        let network = &mut body.network;
        let is_pin: Vec<_> = (0..network.x.len())
            .map(|i| network.masses[i] == 0.0 || network.pins.contains(&(i as u32)))
            .collect();
        for (i, is_pin) in is_pin.iter().enumerate() {
            let particle = first + i as u32;
            if !is_pin {
                network.v[i] = plus(network.v[i], 1.0);
                continue;
            }
            let moved = boosted.changes.iter_mut().find_map(|change| match change {
                Change::Pin { particle: other, target, .. } if *other == particle => Some(target),
                _ => None,
            });
            if let Some(target) = moved {
                *target = plus(*target, end);
            } else {
                let target = plus(network.x[i], end);
                boosted.changes.push(Change::Pin { particle, target, duration: end });
            }
        }
        first += network.x.len() as u32;
    }
    for collider in &mut setup.colliders {
        match &mut collider.way {
            None => collider.velocity = plus(collider.velocity, 1.0),
            Some(way) => {
                let at = |time: f64| PoseKey { time, pose: way.at(time) };
                let (first, last) =
                    (way.keys.first().map(|key| key.time), way.keys.last().map(|key| key.time));
                let mut keys = way.keys.clone();
                if first.is_some_and(|time| time > 0.0) {
                    keys.insert(0, at(0.0));
                }
                if last.is_some_and(|time| time < end) {
                    keys.push(at(end));
                }
                for key in &mut keys {
                    let Pose { position, .. } = &mut key.pose;
                    *position = plus(*position, key.time);
                }
                way.keys = keys;
            }
        }
    }
    boosted
}

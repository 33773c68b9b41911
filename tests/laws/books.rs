//! Books: what frames add up to is what the diagnostics say, momentum comes from what acts, and energy only from what gives it.

use nappe_sim::{
    math::{
        Precision,
        array::{dot, length, minus},
    },
    report::Diagnostics,
};
use nappe_tests::at_random::{Frame, Run, World};

use crate::{
    boost::tighten_snow,
    law::{Law, Verdict, WORK},
};

pub(crate) const LAW: Law = Law { name: "books", judge };

/// A particle as its user knows it: its mass (kg), 0 of a pin.
struct Masses(Vec<f64>);

impl Masses {
    fn of(world: &World) -> Self {
        let mut masses = Vec::new();
        for body in &world.setup.bodies {
            let network = &body.network;
            let first = masses.len();
            masses.extend(&network.masses);
            network.pins.iter().for_each(|pin| masses[first + *pin as usize] = 0.0);
        }
        let snow = world.setup.snow.iter().flat_map(|snow| &snow.objects);
        masses.extend(snow.flat_map(|object| object.mass.iter()));
        Self(masses)
    }

    /// Sums over the particles of a frame of what `of` says of each, and of its size.
    fn sum(&self, frame: &Frame, of: impl Fn([f64; 3], [f64; 3]) -> f64) -> [f64; 2] {
        let particles = self.0.iter().zip(frame.x.iter().zip(&frame.v));
        particles.fold([0.0; 2], |[sum, size], (m, (x, v))| {
            let number = m * of(*x, *v);
            [sum + number, size + number.abs()]
        })
    }
}

fn judge(world: &World) -> Result<Verdict, String> {
    let masses = Masses::of(world);
    // What colliders feel of a semi-implicit step is what its solve leaves of it.
    let mut world = world.clone();
    tighten_snow(&mut world);
    let world = &world;
    let (_, run) = world.run_within(WORK)?;
    let wrong = diagnostics(world, &masses, &run)
        .or_else(|| momentum(world, &masses, &run))
        .or_else(|| energy(world, &run));
    Ok(wrong.map_or(Verdict::Holds, Verdict::Broken))
}

/// Roundings of sums that numbers of frames may differ by.
fn rounding(world: &World) -> f64 {
    if world.precision == Precision::F64 { 1e-12 } else { 1e-4 }
}

fn diagnostics(world: &World, masses: &Masses, run: &Run) -> Option<String> {
    let gravity = world.setup.gravity;
    run.frames.iter().enumerate().find_map(|(step, frame)| {
        let Diagnostics { kinetic_energy, gravitational_energy, momentum, .. } = frame.report.diagnostics;
        let sums = [
            ("kinetic energy", kinetic_energy, masses.sum(frame, |_, v| 0.5 * dot(v, v))),
            ("gravitational energy", gravitational_energy, masses.sum(frame, |x, _| -dot(gravity, x))),
            ("momentum along x", momentum[0], masses.sum(frame, |_, v| v[0])),
            ("momentum along y", momentum[1], masses.sum(frame, |_, v| v[1])),
            ("momentum along z", momentum[2], masses.sum(frame, |_, v| v[2])),
        ];
        sums.into_iter().find_map(|(what, told, [sum, size])| {
            let is_right = (told - sum).abs() <= rounding(world) * size + 1e-300;
            (!is_right)
                .then(|| format!("step {step}: the {what} is told as {told:e}, and adds up to {sum:e}"))
        })
    })
}

/// Of scenes whose medium does nothing and that no pin holds.
fn momentum(world: &World, masses: &Masses, run: &Run) -> Option<String> {
    let setup = &world.setup;
    let has_medium = setup.bodies.iter().any(|body| body.network.drag != 0.0 || body.network.air.is_some());
    let is_dragged = setup.snow.as_ref().is_some_and(|snow| snow.settings.drag != 0.0);
    if has_medium || is_dragged || masses.0.contains(&0.0) {
        return None;
    }
    let mass: f64 = masses.0.iter().sum();
    let mut acting = setup.gravity.map(|g| mass * g);
    for body in &setup.bodies {
        for force in &body.forces {
            let count = force.particles.len() as f64;
            acting = [0, 1, 2].map(|c| acting[c] + count * force.force[c]);
        }
    }
    run.frames.windows(2).enumerate().find_map(|(step, frames)| {
        let [before, after] = [&frames[0], &frames[1]];
        let moving = |frame: &Frame| masses.sum(frame, |_, v| length(v))[0];
        let loads = after.report.loads.iter();
        let felt = loads.fold([0.0; 3], |felt, load| [0, 1, 2].map(|c| felt[c] + load.force[c]));
        let pressed: f64 = after.report.loads.iter().map(|load| length(load.force)).sum();
        let gained = minus(after.report.diagnostics.momentum, before.report.diagnostics.momentum);
        let off = length([0, 1, 2].map(|c| gained[c] - setup.dt * (acting[c] - felt[c])));
        let terms = moving(before) + moving(after) + setup.dt * (length(acting) + pressed);
        let share = if world.precision == Precision::F64 { 1e-10 } else { 1e-4 };
        (off > share * terms)
            .then(|| format!("step {step}: momentum is {off:e} N s off, of {terms:e} N s that act and move"))
    })
}

/// Of scenes in which no pin moves, no wind blows, and colliders keep their velocity.
fn energy(world: &World, run: &Run) -> Option<String> {
    let setup = &world.setup;
    let blows = setup.wind != [0.0; 3] || !setup.wind_at.is_empty();
    let has_keys = setup.colliders.iter().any(|collider| collider.way.is_some());
    if blows || has_keys || !world.changes.is_empty() || begins_inside(world, run) {
        return None;
    }
    let is_explicit = |body: &nappe_sim::world::BodySetup| !body.settings.integrator.is_implicit();
    let share = if setup.snow.is_some() || setup.bodies.iter().any(is_explicit) { 1.0 } else { 0.25 };
    let of = |frame: &Frame| frame.report.diagnostics.total_energy();
    let moves = |frame: &Frame| {
        let Diagnostics { kinetic_energy, elastic_energy, .. } = frame.report.diagnostics;
        kinetic_energy + elastic_energy
    };
    // Positions are off by a rounding, against all springs.
    let springs = setup.bodies.iter().flat_map(|body| &body.network.springs);
    let stiffness: f64 = springs.map(|spring| spring.law.stiffness).sum();
    let unit = if world.precision == Precision::F64 { f64::EPSILON } else { f64::from(f32::EPSILON) };
    let far = run
        .frames
        .iter()
        .flat_map(|frame| frame.x.as_flattened())
        .fold(0.0, |most: f64, c| most.max(c.abs()));
    let floor = stiffness * (4.0 * unit * far).powi(2);
    let start = of(&run.frames[0]);
    let (mut given, mut most) = (0.0, moves(&run.frames[0]));
    run.frames.iter().enumerate().skip(1).find_map(|(step, frame)| {
        for (collider, load) in setup.colliders.iter().zip(frame.report.loads.iter()) {
            given -= setup.dt * dot(load.force, collider.velocity);
        }
        given += frame.report.diagnostics.external_work;
        let gain = of(frame) - start - given;
        most = most.max(moves(frame) - gain);
        let scale = of(frame).abs() + start.abs() + moves(frame);
        let limit = share * most + 100.0 * rounding(world) * scale + floor;
        (gain > limit).then(|| {
            format!("step {step}: energy rose by {gain:e} J that nothing gave, {limit:e} J may be owed")
        })
    })
}

/// Whether any particle begins a step inside a collider, which gives it energy that nobody counts.
fn begins_inside(world: &World, run: &Run) -> bool {
    let size = world.size();
    run.frames.iter().enumerate().any(|(step, frame)| {
        let time = world.setup.dt * step as f64;
        let is_inside = |x: &[f64; 3]| {
            let colliders = world.setup.colliders.iter();
            colliders
                .into_iter()
                .any(|collider| collider.distance(*x, time).0 < collider.margin - 1e-3 * size)
        };
        world.setup.snow.is_none() && frame.x.iter().any(is_inside)
    })
}

//! Half the step, and half of that: what runs differ by shrinks at the order of the method, or by a half and more where contact makes it one.
//!
//! It is asked of motion that steps resolve: they are as short as the fastest spring needs, and the run is a few of them.

use nappe_sim::cloth::Integrator;
use nappe_tests::at_random::{Run, World};

use crate::{
    boost::tight,
    law::{Law, Verdict, apart},
};

pub(crate) const LAW: Law = Law { name: "halves", judge };

/// What the fastest mode turns by in the longest step (rad).
const TURN: f64 = 0.05;
/// Steps of the longest run.
const STEPS: u64 = 8;
/// Share of the way below which differences are rounding.
const LEAST: f64 = 1e-9;

fn judge(world: &World) -> Result<Verdict, String> {
    if world.setup.snow.is_some() || !world.changes.is_empty() {
        return Ok(Verdict::Silent);
    }
    let mut first = tight(world);
    let Some(dt) = resolved(&first) else { return Ok(Verdict::Silent) };
    (first.setup.dt, first.steps) = (dt.min(world.setup.dt), STEPS);
    let mut second = first.clone();
    (second.setup.dt, second.steps) = (0.5 * first.setup.dt, 2 * STEPS);
    let mut third = first.clone();
    (third.setup.dt, third.steps) = (0.25 * first.setup.dt, 4 * STEPS);
    let runs = [first.run()?, second.run()?, third.run()?];
    if runs.iter().any(|run| run.end.is_some()) {
        return Ok(Verdict::Silent);
    }
    let is_whole = |run: &Run| {
        let cloths = run.frames[1..].iter().filter_map(|frame| frame.report.cloth);
        cloths.into_iter().all(|cloth| (cloth.substeps, cloth.rejected) == (1, 0))
    };
    if !runs.iter().all(is_whole) {
        return Ok(Verdict::Silent);
    }
    let is_free = runs.iter().flat_map(|run| &run.frames).all(|frame| frame.report.contact_count == 0);
    let last = |run: &Run| run.frames.last().expect("frames").x.clone();
    let ends = runs.each_ref().map(last);
    let [coarse, fine] = [apart(&ends[0], &ends[1], [0.0; 3]), apart(&ends[1], &ends[2], [0.0; 3])];
    let way = apart(&runs[0].frames[0].x, &ends[2], [0.0; 3]) + world.size();
    let needed = if is_free && order(world) == 2 { 2.5 } else { 1.5 };
    if fine < LEAST * way || fine * needed <= coarse {
        return Ok(Verdict::Holds);
    }
    Ok(Verdict::Broken(format!(
        "steps of {:e} s: halves differ by {coarse:e} m, quarters by {fine:e} m, of which {needed} times less is needed",
        first.setup.dt
    )))
}

/// The least order of the methods of a world.
fn order(world: &World) -> u32 {
    let of = |body: &nappe_sim::world::BodySetup| match body.settings.integrator {
        Integrator::ImplicitMidpoint | Integrator::VelocityVerletPredicted => 2,
        Integrator::VelocityVerlet
            if body.network.drag == 0.0
                && body.network.air.is_none()
                && body.network.springs.iter().all(|spring| spring.law.damping == 0.0) =>
        {
            2
        }
        _ => 1,
    };
    world.setup.bodies.iter().map(of).min().unwrap_or(1)
}

/// A step (s) in which no mode turns far and no particle moves far; none of a world without springs.
fn resolved(world: &World) -> Option<f64> {
    let mut least = f64::INFINITY;
    for body in &world.setup.bodies {
        let network = &body.network;
        for spring in &network.springs {
            let [m, n] = spring.particles.map(|particle| network.masses[particle as usize]);
            let mass = if m.min(n) > 0.0 { m.min(n) } else { m.max(n) };
            least = least.min(TURN * (mass / (8.0 * spring.law.stiffness)).sqrt());
            if spring.law.damping > 0.0 {
                least = least.min(TURN * mass / (8.0 * spring.law.damping));
            }
            let apart = nappe_tests::scene::difference(
                network.v[spring.particles[0] as usize],
                network.v[spring.particles[1] as usize],
            );
            let speed = nappe_tests::scene::norm(apart);
            if speed > 0.0 {
                least = least.min(TURN * spring.rest_length / speed);
            }
        }
        if network.drag > 0.0 {
            let lightest = network.masses.iter().copied().filter(|m| *m > 0.0).fold(f64::INFINITY, f64::min);
            least = least.min(TURN * lightest / network.drag);
        }
    }
    least.is_finite().then_some(least)
}

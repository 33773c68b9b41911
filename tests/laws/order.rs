//! Bodies, and particles within them, in another order: the same motion.
//!
//! Vertex block descent is left out, which moves particles in their order, and laws of elements, whose particles nobody outside renames.

use nappe_sim::{cloth::Minimizer, linalg::Stop, world::Change};
use nappe_tests::at_random::{Run, World};

use crate::{
    boost::tight,
    law::{Law, Verdict, WORK, alike, shaken, spread},
};

pub(crate) const LAW: Law = Law { name: "order", judge };

const ALLOWED: f64 = 1e-9;
const SPREADS: f64 = 1e4;

fn judge(world: &World) -> Result<Verdict, String> {
    let is_ordered = |body: &nappe_sim::world::BodySetup| {
        matches!(body.settings.minimizer, Minimizer::VertexBlockDescent { .. })
            || !body.network.elements.is_empty()
    };
    if world.setup.snow.is_some() || world.setup.bodies.iter().any(is_ordered) {
        return Ok(Verdict::Silent);
    }
    let mut first = tight(world);
    for body in &mut first.setup.bodies {
        body.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 4000 };
    }
    let (first, run) = first.run_within(WORK)?;
    let rounding = 1e-15 * (1.0 + world.size() / world.setup.dt);
    let spread = spread(&run, &shaken(&first, rounding).run()?);
    let allowed = |step: usize| {
        ALLOWED * world.size() + SPREADS * spread.get(step).or(spread.last()).copied().unwrap_or_default()
    };
    let mut second: Run = reversed(&first).run()?;
    for frame in &mut second.frames {
        frame.x.reverse();
    }
    Ok(alike(&run, &second, |_| [0.0; 3], allowed))
}

/// All bodies and all particles the other way round.
fn reversed(world: &World) -> World {
    let mut reversed = world.clone();
    let mut count = 0;
    reversed.setup.bodies.reverse();
    for body in &mut reversed.setup.bodies {
        let network = &mut body.network;
        let last = network.x.len() as u32 - 1;
        count += last + 1;
        network.x.reverse();
        network.v.reverse();
        network.masses.reverse();
        network.uv.reverse();
        network.pins.iter_mut().for_each(|pin| *pin = last - *pin);
        network.springs.reverse();
        for spring in &mut network.springs {
            spring.particles = spring.particles.map(|particle| last - particle);
        }
        network.triangles.reverse();
        for corners in &mut network.triangles {
            *corners = corners.map(|corner| last - corner);
        }
        for force in &mut body.forces {
            force.particles.iter_mut().for_each(|particle| *particle = last - *particle);
        }
    }
    for change in &mut reversed.changes {
        if let Change::Pin { particle, .. } = change {
            *particle = count - 1 - *particle;
        }
    }
    reversed
}

//! A smooth plane pushes along its normal alone, and what stays away from a surface is not touched by it.

use nappe_sim::{
    collide::{Contact, Shape},
    math::{
        Precision,
        array::{dot, length},
    },
};
use nappe_tests::at_random::World;

use crate::law::{Law, Verdict, WORK};

pub(crate) const LAW: Law = Law { name: "smooth", judge };

fn judge(world: &World) -> Result<Verdict, String> {
    if world.setup.colliders.is_empty() {
        return Ok(Verdict::Silent);
    }
    let mut smooth = world.clone();
    smooth.setup.colliders.iter_mut().for_each(|collider| {
        collider.friction = 0.0;
        if collider.contact == Contact::Sticky {
            collider.contact = Contact::Separating;
        }
    });
    let (_, run) = smooth.run_within(WORK)?;
    let share = if world.precision == Precision::F64 { 1e-9 } else { 1e-3 };
    let is_alone = smooth.setup.colliders.len() == 1;
    let reach = smooth.setup.snow.as_ref().map_or(0.0, |snow| 3.0 * snow.settings.cell);
    for (number, collider) in smooth.setup.colliders.iter().enumerate() {
        let plane = match &collider.shape {
            Shape::Plane(plane) if collider.way.is_none() && is_alone => Some(plane.normal),
            _ => None,
        };
        let is_still = collider.way.is_none() && collider.velocity == [0.0; 3];
        for (step, frames) in run.frames.windows(2).enumerate() {
            let Some(load) = frames[1].report.loads.get(number) else { continue };
            if let Some(normal) = plane {
                let across = dot(load.force, normal);
                let along = length([0, 1, 2].map(|c| load.force[c] - across * normal[c]));
                if along > share * length(load.force) {
                    return Ok(Verdict::Broken(format!(
                        "step {step}: the plane {} pushes by {along:e} N along itself, and by {across:e} N across",
                        collider.name
                    )));
                }
            }
            let dt = smooth.setup.dt;
            let fastest = frames.iter().flat_map(|frame| &frame.v).map(|v| length(*v)).fold(0.0, f64::max);
            let gap = |x: &[f64; 3]| collider.distance(*x, 0.0).0 - collider.margin;
            let nearest = frames.iter().flat_map(|frame| &frame.x).map(gap).fold(f64::INFINITY, f64::min);
            let is_far = is_still && nearest > 4.0 * dt * fastest + reach;
            if is_far && (load.contacts > 0 || load.force != [0.0; 3]) {
                return Ok(Verdict::Broken(format!(
                    "step {step}: {} is {nearest:e} m away from all, and touched {} times",
                    collider.name, load.contacts
                )));
            }
        }
    }
    Ok(Verdict::Holds)
}

//! Parameters of a simulation as the message that describes its session.

use nappe_proto::v1;
use nappe_sim::{
    cloth::{Air, SpringKind},
    collide::Pose,
    world::{CalledForces, ClothParameters, Forces, Simulation, SpringRange, WorldParameters},
};
use prost::bytes::Bytes;

use crate::stream::pose;

/// Particles whose forces are told, of all bodies together, at most: about 112 KiB.
const MOST_LISTED: usize = 4096;

/// The message of parameters as they are.
pub(super) fn parameters(simulation: &Simulation) -> v1::Parameters {
    let WorldParameters { gravity, wind, cloths, colliders } = simulation.parameters();
    v1::Parameters {
        gravity: Some(gravity.into()),
        wind: Some(wind.into()),
        cloths: cloths.into_iter().map(cloth).collect(),
        collider_poses: colliders.into_iter().map(|(name, now)| pose(name, now)).collect(),
        forces: simulation.called_forces(MOST_LISTED).into_iter().map(forces).collect(),
    }
}

fn forces(CalledForces { body, particles, forces }: CalledForces) -> v1::ForceUpdate {
    let (force, forces_f64) = match forces {
        None => (None, Bytes::new()),
        Some(Forces::One(force)) => (Some(force.into()), Bytes::new()),
        Some(Forces::Each(each)) => {
            (None, each.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect())
        }
    };
    let particles_u32 = particles.iter().flat_map(|particle| particle.to_le_bytes()).collect();
    v1::ForceUpdate { body, particles_u32, force, forces_f64 }
}

/// Tells where the colliders are now, in the order that they have been told in.
pub(super) fn put_collider_poses(told: &mut v1::Parameters, now: impl Fn(usize) -> Pose) {
    for (index, told) in told.collider_poses.iter_mut().enumerate() {
        let Pose { position, turn } = now(index);
        (told.position, told.turn) = (Some(position.into()), Some(turn.into()));
    }
}

fn cloth(told: ClothParameters) -> v1::ClothParameters {
    let ClothParameters { name, drag, air, springs, pull_count } = told;
    let springs = springs.into_iter().map(springs_of_kind).collect();
    let air =
        air.map(|Air { density, normal, lift, tangential }| v1::Air { density, normal, lift, tangential });
    v1::ClothParameters { body: name, drag, springs, air, pull_count: pull_count as u32 }
}

fn springs_of_kind(SpringRange { kind, stiffness, damping }: SpringRange) -> v1::SpringParameters {
    let kind = match kind {
        SpringKind::Stretch => v1::SpringKind::Stretch,
        SpringKind::Shear => v1::SpringKind::Shear,
        SpringKind::Bend => v1::SpringKind::Bend,
    };
    let ([min_stiffness, max_stiffness], [min_damping, max_damping]) = (stiffness, damping);
    v1::SpringParameters { kind: kind.into(), min_stiffness, max_stiffness, min_damping, max_damping }
}

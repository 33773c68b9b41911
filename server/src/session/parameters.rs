//! Parameters of a simulation as the message that describes its session.

use nappe_proto::v1;
use nappe_sim::{
    cloth::{Air, SpringKind},
    collide::Pose,
    world::{ClothParameters, SpringRange, WorldParameters},
};

use crate::stream::pose;

/// The message of parameters as they are.
pub(super) fn parameters(now: WorldParameters) -> v1::Parameters {
    let WorldParameters { gravity, wind, cloths, colliders } = now;
    v1::Parameters {
        gravity: Some(gravity.into()),
        wind: Some(wind.into()),
        cloths: cloths.into_iter().map(cloth).collect(),
        collider_poses: colliders.into_iter().map(|(name, now)| pose(name, now)).collect(),
    }
}

/// Tells where the colliders are now, in the order that they have been told in.
pub(super) fn put_collider_poses(told: &mut v1::Parameters, now: impl Fn(usize) -> Pose) {
    for (index, told) in told.collider_poses.iter_mut().enumerate() {
        let Pose { position, turn } = now(index);
        (told.position, told.turn) = (Some(position.into()), Some(turn.into()));
    }
}

fn cloth(ClothParameters { name, drag, air, springs }: ClothParameters) -> v1::ClothParameters {
    let springs = springs.into_iter().map(springs_of_kind).collect();
    let air =
        air.map(|Air { density, normal, lift, tangential }| v1::Air { density, normal, lift, tangential });
    v1::ClothParameters { body: name, drag, springs, air }
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

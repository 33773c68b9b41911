//! The changes of a request to update parameters, or to step with other ones.
//!
//! Enters: the request. Leaves: changes for the simulation, or the first invalid field.

use nappe_proto::v1;
use nappe_sim::{cloth::SpringKind, world::Change};

use super::{
    collider_moves,
    lists::{self, MeshById},
    validate::{finite, finite_vector, unknown_value},
};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
};

/// The changes of a request to update parameters.
pub(super) fn of_update(request: v1::UpdateParametersRequest) -> v1::Changes {
    let v1::UpdateParametersRequest {
        gravity,
        wind,
        drag,
        springs,
        pins,
        paths,
        air,
        forces,
        states,
        colliders,
        collider_paths,
        pulls,
        ..
    } = request;
    v1::Changes {
        gravity,
        wind,
        drag,
        springs,
        pins,
        paths,
        air,
        forces,
        states,
        colliders,
        collider_paths,
        pulls,
    }
}

/// Changes in the order of their fields, which `within` stands before in messages.
///
/// # Errors
/// More changes than are allowed, a number that is not finite, a kind that does not exist, or no change at all.
pub(super) fn changes(
    request: &v1::Changes,
    within: &str,
    limits: &Limits,
    mesh: &MeshById<'_>,
) -> Result<Vec<Change>, ServiceError> {
    check_count(request, limits.max_changes_per_call)?;
    let mut changes = Vec::new();
    if let Some(gravity) = request.gravity {
        changes.push(Change::Gravity(finite_vector(&format!("{within}gravity"), gravity)?));
    }

    if let Some(wind) = request.wind {
        changes.push(Change::Wind(finite_vector(&format!("{within}wind"), wind)?));
    }

    if let Some(drag) = request.drag {
        changes.push(Change::Drag(finite(&format!("{within}drag"), drag)?));
    }

    for (i, update) in request.air.iter().enumerate() {
        changes.push(air(&format!("{within}air[{i}]"), update)?);
    }

    for (i, update) in request.springs.iter().enumerate() {
        changes.push(springs(&format!("{within}springs[{i}]"), update)?);
    }

    for (i, update) in request.pins.iter().enumerate() {
        changes.push(pin(&format!("{within}pins[{i}]"), update)?);
    }

    for (i, path) in request.paths.iter().enumerate() {
        changes.push(pin_path(&format!("{within}paths[{i}]"), path)?);
    }

    for (i, update) in request.forces.iter().enumerate() {
        changes.push(lists::force(&format!("{within}forces[{i}]"), update)?);
    }

    for (i, update) in request.pulls.iter().enumerate() {
        changes.push(lists::pull(&format!("{within}pulls[{i}]"), update)?);
    }

    for (i, update) in request.states.iter().enumerate() {
        changes.push(lists::state(&format!("{within}states[{i}]"), update, mesh)?);
    }

    for (i, update) in request.colliders.iter().enumerate() {
        changes.push(collider_moves::update(&format!("{within}colliders[{i}]"), update)?);
    }

    for (i, path) in request.collider_paths.iter().enumerate() {
        changes.push(collider_moves::path(&format!("{within}collider_paths[{i}]"), path)?);
    }

    if changes.is_empty() {
        return Err(ServiceError::field(
            format!(
                "{within}gravity, wind, drag, air, springs, pins, paths, forces, pulls, states, colliders, collider_paths"
            ),
            "none is set: an update changes at least one",
        ));
    }
    Ok(changes)
}

/// Each point of a path counts, and each path too.
fn check_count(request: &v1::Changes, allowed: u32) -> Result<(), ServiceError> {
    let of_pins = request.paths.iter().map(|path| path.times_seconds.len()).sum::<usize>();
    let of_colliders = request.collider_paths.iter().map(|path| path.times_seconds.len()).sum::<usize>();
    let lists = [
        request.springs.len(),
        request.air.len(),
        request.pins.len(),
        request.paths.len().max(of_pins),
        request.forces.len(),
        request.pulls.len(),
        request.states.len(),
        request.colliders.len(),
        request.collider_paths.len().max(of_colliders),
    ];
    let count = lists.into_iter().sum::<usize>();
    if count <= allowed as usize {
        return Ok(());
    }
    let message = format!(
        "the call has {count} changes of springs, air, forces, pulls, states, pins, colliders and points of paths; allowed: at most {allowed}"
    );
    Err(ServiceError::new(Reason::TooManyChanges, message).with("changes", count).with("allowed", allowed))
}

/// Ranges are the simulation's to check.
fn air(field: &str, update: &v1::AirUpdate) -> Result<Change, ServiceError> {
    let v1::AirUpdate { body, density, normal, lift, tangential } = update;
    if [density, normal, lift, tangential].iter().all(|number| number.is_none()) {
        return Err(ServiceError::field(field, "has neither density nor normal, lift or tangential"));
    }
    let number = |name: &str, value: &Option<f64>| {
        value.map(|value| finite(&format!("{field}.{name}"), value)).transpose()
    };
    Ok(Change::Air {
        body: (!body.is_empty()).then(|| body.clone()),
        density: number("density", density)?,
        normal: number("normal", normal)?,
        lift: number("lift", lift)?,
        tangential: number("tangential", tangential)?,
    })
}

fn springs(field: &str, update: &v1::SpringUpdate) -> Result<Change, ServiceError> {
    let kind = match v1::SpringKind::try_from(update.kind) {
        Ok(v1::SpringKind::Unspecified) => None,
        Ok(v1::SpringKind::Stretch) => Some(SpringKind::Stretch),
        Ok(v1::SpringKind::Shear) => Some(SpringKind::Shear),
        Ok(v1::SpringKind::Bend) => Some(SpringKind::Bend),
        Err(_unknown) => return Err(unknown_value(&format!("{field}.kind"), update.kind)),
    };
    if update.stiffness.is_none() && update.damping.is_none() {
        return Err(ServiceError::field(field, "has neither stiffness nor damping"));
    }

    let number = |name: &str, value: Option<f64>| {
        value.map(|value| finite(&format!("{field}.{name}"), value)).transpose()
    };
    Ok(Change::Springs {
        body: (!update.body.is_empty()).then(|| update.body.clone()),
        kind,
        stiffness: number("stiffness", update.stiffness)?,
        damping: number("damping", update.damping)?,
    })
}

fn pin(field: &str, update: &v1::PinUpdate) -> Result<Change, ServiceError> {
    let target_field = format!("{field}.target");
    let target = update
        .target
        .ok_or_else(|| ServiceError::field(&target_field, "is missing: a pin moves to a point (m)"))?;
    Ok(Change::Pin {
        particle: update.particle,
        target: finite_vector(&target_field, target)?,
        duration: finite(&format!("{field}.duration_seconds"), update.duration_seconds)?,
    })
}

/// Ranges, and that times grow, are the simulation's to check.
fn pin_path(field: &str, path: &v1::PinPath) -> Result<Change, ServiceError> {
    let v1::PinPath { particle, times_seconds: times, targets } = path;
    let (targets, rest) = targets.as_chunks::<3>();
    if targets.len() != times.len() || !rest.is_empty() {
        let (numbers, times) = (3 * targets.len() + rest.len(), times.len());
        let problem = format!("has {numbers} numbers: three for each of {times} times are needed");
        return Err(ServiceError::field(format!("{field}.targets"), problem)
            .with("numbers", numbers)
            .with("times", times));
    }

    let points = times.iter().copied().zip(targets.iter().copied()).collect();
    Ok(Change::PinPath { particle: *particle, points })
}

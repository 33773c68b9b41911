//! The changes of a request to update parameters.
//!
//! Enters: the request. Leaves: changes for the simulation, or the first invalid field.

use nappe_proto::v1;
use nappe_sim::{cloth::SpringKind, world::Change};

use super::validate::{finite, unknown_value};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
};

/// The changes of an update, in the order of its fields.
///
/// # Errors
/// More changes than are allowed, a number that is not finite, a kind that does not exist, or no change at all.
pub(super) fn changes(
    request: &v1::UpdateParametersRequest,
    limits: &Limits,
) -> Result<Vec<Change>, ServiceError> {
    let (count, allowed) = (request.springs.len() + request.pins.len(), limits.max_changes_per_call);
    if count > allowed as usize {
        let message = format!("the call has {count} changes of springs and pins; allowed: at most {allowed}");
        return Err(ServiceError::new(Reason::TooManyChanges, message)
            .with("changes", count)
            .with("allowed", allowed));
    }

    let mut changes = Vec::new();
    if let Some(gravity) = request.gravity {
        changes.push(Change::Gravity(finite_vector("gravity", gravity)?));
    }

    if let Some(wind) = request.wind {
        changes.push(Change::Wind(finite_vector("wind", wind)?));
    }

    if let Some(drag) = request.drag {
        changes.push(Change::Drag(finite("drag", drag)?));
    }

    for (i, update) in request.springs.iter().enumerate() {
        changes.push(springs(&format!("springs[{i}]"), update)?);
    }

    for (i, update) in request.pins.iter().enumerate() {
        changes.push(pin(&format!("pins[{i}]"), update)?);
    }

    if changes.is_empty() {
        return Err(ServiceError::field(
            "gravity, wind, drag, springs, pins",
            "none is set: an update changes at least one",
        ));
    }
    Ok(changes)
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

fn finite_vector(field: &str, vector: v1::Vector3) -> Result<[f64; 3], ServiceError> {
    let v1::Vector3 { x, y, z } = vector;
    Ok([
        finite(&format!("{field}.x"), x)?,
        finite(&format!("{field}.y"), y)?,
        finite(&format!("{field}.z"), z)?,
    ])
}

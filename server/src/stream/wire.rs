//! Simulation types to messages, messages to changes: the only place where both are known.

use nappe_proto::v1;
use nappe_sim::{
    cloth::SpringKind,
    collide::{Collider, Shape},
    linalg::{Outcome, SolveReport},
    math::Precision,
    report::{BoundKind, SnowReport, Stage},
    world::{BodyTopology, Change, ChangeError},
};

use super::frame::TOPOLOGY_ID;
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
};

/// The topology message of a session.
pub(crate) fn topology(bodies: &[BodyTopology], colliders: &[Collider]) -> v1::Topology {
    v1::Topology {
        topology_id: TOPOLOGY_ID,
        particle_count: bodies.iter().map(|body| body.particle_count).sum(),
        bodies: bodies.iter().map(body).collect(),
        colliders: colliders.iter().map(collider).collect(),
        chunk: None,
    }
}

fn body(body: &BodyTopology) -> v1::BodyTopology {
    let springs = if body.triangles.is_empty() { body.springs.as_slice() } else { &[] };
    v1::BodyTopology {
        name: body.name.clone(),
        first_particle: body.first_particle,
        particle_count: body.particle_count,
        triangles_u32: pack(body.triangles.as_flattened().iter().map(|i| i.to_le_bytes())),
        springs_u32: pack(springs.as_flattened().iter().map(|i| i.to_le_bytes())),
        pins_u32: pack(body.pins.iter().map(|i| i.to_le_bytes())),
        uv_f32: pack(body.uv.as_flattened().iter().map(|c| (*c as f32).to_le_bytes())),
    }
}

fn pack(numbers: impl Iterator<Item = [u8; 4]>) -> bytes::Bytes {
    numbers.flatten().collect::<Vec<u8>>().into()
}

fn collider(collider: &Collider) -> v1::ColliderShape {
    use v1::collider_shape::Shape as Wire;
    let velocity = Some(vector(collider.velocity));
    let shape = match collider.shape {
        Shape::Plane { point, normal } => {
            Wire::Plane(v1::PlaneShape { point: Some(vector(point)), normal: Some(vector(normal)), velocity })
        }
        Shape::Sphere { center, radius } => {
            Wire::Sphere(v1::SphereShape { center: Some(vector(center)), radius, velocity })
        }
        Shape::Capsule { start, end, radius } => Wire::Capsule(v1::CapsuleShape {
            start: Some(vector(start)),
            end: Some(vector(end)),
            radius,
            velocity,
        }),
        Shape::Box { center, half_extent, axes: [axis_x, axis_y, _] } => Wire::Box(v1::BoxShape {
            center: Some(vector(center)),
            half_extent: Some(vector(half_extent)),
            axis_x: Some(vector(axis_x)),
            axis_y: Some(vector(axis_y)),
            velocity,
        }),
        Shape::Cylinder { start, end, radius } => Wire::Cylinder(v1::CylinderShape {
            start: Some(vector(start)),
            end: Some(vector(end)),
            radius,
            velocity,
        }),
        Shape::HalfPipe { point, axis, up, radius } => Wire::HalfPipe(v1::HalfPipeShape {
            point: Some(vector(point)),
            axis: Some(vector(axis)),
            up: Some(vector(up)),
            radius,
            velocity,
        }),
    };
    v1::ColliderShape { name: collider.name.clone(), shape: Some(shape) }
}

/// Three numbers.
pub(crate) fn vector([x, y, z]: [f64; 3]) -> v1::Vector3 {
    v1::Vector3 { x, y, z }
}

/// The message of a solve.
pub(crate) fn solve(report: &SolveReport) -> v1::SolveReport {
    let outcome = match report.outcome {
        Outcome::Converged => v1::SolveOutcome::Converged,
        Outcome::IterationCap => v1::SolveOutcome::IterationCap,
        Outcome::NegativeCurvature { .. } => v1::SolveOutcome::NegativeCurvature,
        Outcome::ZeroCurvature { .. } => v1::SolveOutcome::ZeroCurvature,
        Outcome::Singular { .. } => v1::SolveOutcome::Singular,
        Outcome::NotFinite { .. } => v1::SolveOutcome::NotFinite,
    };
    v1::SolveReport {
        outcome: outcome.into(),
        iterations: report.iterations,
        relative_residual: report.relative_residual,
    }
}

/// The message of the snow's figures. A bound that allows any step is told as the largest number.
pub(crate) fn snow(report: &SnowReport) -> v1::SnowDiagnostics {
    let bound = match report.bound.kind {
        BoundKind::ElasticWave => v1::TimeBound::ElasticWave,
        BoundKind::IsolatedParticle => v1::TimeBound::IsolatedParticle,
        BoundKind::ParticleSpeed => v1::TimeBound::ParticleSpeed,
        BoundKind::VelocityGradient => v1::TimeBound::VelocityGradient,
        BoundKind::ColliderSpeed => v1::TimeBound::ColliderSpeed,
        BoundKind::Fixed => v1::TimeBound::Fixed,
        BoundKind::Frame => v1::TimeBound::Frame,
    };
    let [min_plastic_ratio, max_plastic_ratio] = report.jp_range;
    v1::SnowDiagnostics {
        substeps: report.substeps,
        dt_seconds: report.dt,
        bound: bound.into(),
        bound_particle: report.bound.particle,
        bound_seconds: report.bound.dt.min(f64::MAX),
        mass: report.mass,
        grid_mass_error: report.grid_mass_error,
        plastic_count: report.plastic_count,
        inverted_count: report.inverted_count,
        clamped_count: report.clamped_count,
        ballistic_count: report.ballistic_count,
        min_plastic_ratio,
        max_plastic_ratio,
        max_speed: report.max_speed,
        dropped_momentum: report.dropped_momentum,
        angular_momentum: Some(vector(report.angular_momentum)),
        block_count: report.block_count,
    }
}

/// Seconds of each stage, those that took any.
pub(crate) fn stages(seconds: &[f64; Stage::ALL.len()]) -> Vec<v1::StageTime> {
    let times = Stage::ALL.iter().zip(seconds).filter(|(_, seconds)| **seconds > 0.0);
    times
        .map(|(stage, seconds)| v1::StageTime { stage: stage.name().to_owned(), seconds: *seconds })
        .collect()
}

/// The message of a precision.
pub(crate) fn precision(precision: Precision) -> v1::Precision {
    match precision {
        Precision::F32 => v1::Precision::F32,
        Precision::F64 => v1::Precision::F64,
    }
}

/// The message of the limits.
pub(crate) fn limits(limits: &Limits) -> v1::Limits {
    v1::Limits {
        max_sessions: limits.max_sessions,
        max_watchers_per_session: limits.max_watchers_per_session,
        max_particles: limits.max_particles,
        max_springs: limits.max_springs,
        max_mesh_bytes: limits.max_mesh_bytes,
        max_scene_bytes: limits.max_scene_bytes,
        max_meshes: limits.max_meshes,
        max_threads_per_session: limits.thread_limit(),
        max_steps_per_call: limits.max_steps_per_call,
        history_bytes_per_session: limits.history_bytes_per_session,
        max_message_bytes: limits.max_message_bytes,
        max_connections: limits.max_connections,
        max_uploads: limits.max_uploads,
        max_streams_per_connection: limits.max_streams_per_connection,
        max_pending_changes: limits.max_pending_changes,
        max_mesh_store_bytes: limits.max_mesh_store_bytes,
        max_grid_nodes: limits.max_grid_nodes,
    }
}

/// The changes of an update, in the order of its fields.
///
/// # Errors
/// A number that is not finite, a kind that does not exist, or no change at all.
pub(crate) fn changes(request: &v1::UpdateParametersRequest) -> Result<Vec<Change>, ServiceError> {
    let mut changes = Vec::new();
    if let Some(gravity) = &request.gravity {
        changes.push(Change::Gravity(finite_vector("gravity", gravity)?));
    }
    if let Some(wind) = &request.wind {
        changes.push(Change::Wind(finite_vector("wind", wind)?));
    }
    if let Some(drag) = request.drag {
        changes.push(Change::Drag(finite("drag", drag)?));
    }
    for (i, update) in request.springs.iter().enumerate() {
        changes.push(springs(&format!("springs[{i}]"), update)?);
    }
    for (i, update) in request.pins.iter().enumerate() {
        let target = update.target.as_ref().ok_or_else(|| {
            ServiceError::field(format!("pins[{i}].target"), "is missing: a pin moves to a point (m)")
        })?;
        changes.push(Change::Pin {
            particle: update.particle,
            target: finite_vector(&format!("pins[{i}].target"), target)?,
            duration: finite(&format!("pins[{i}].duration_seconds"), update.duration_seconds)?,
        });
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

fn finite_vector(field: &str, v: &v1::Vector3) -> Result<[f64; 3], ServiceError> {
    Ok([
        finite(&format!("{field}.x"), v.x)?,
        finite(&format!("{field}.y"), v.y)?,
        finite(&format!("{field}.z"), v.z)?,
    ])
}

/// A finite number.
///
/// # Errors
/// One that is not.
pub(crate) fn finite(field: &str, value: f64) -> Result<f64, ServiceError> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(ServiceError::field(field, format!("is {value}: a finite number is needed")).with("value", value))
}

/// An enum's number that this version does not know.
pub(crate) fn unknown_value(field: &str, value: i32) -> ServiceError {
    ServiceError::field(field, format!("is {value}, which this version does not know")).with("value", value)
}

/// A change that the simulation refused.
pub(crate) fn refused(error: &ChangeError) -> ServiceError {
    let refused = ServiceError::new(Reason::InvalidChange, error.to_string());
    match error {
        ChangeError::OutOfRange { field, value, allowed } => refused
            .with("field", field)
            .with("value", value)
            .at_field(*field, format!("is {value}: {allowed}")),
        ChangeError::UnknownBody { name, known } => {
            refused.with("body", name).with("known", known).at_field("springs.body", error.to_string())
        }
        ChangeError::NoSuchSprings { body, kind } => {
            refused.with("body", body).with("kind", kind).at_field("springs.kind", error.to_string())
        }
        ChangeError::SnowHasNoSprings { name } => {
            refused.with("body", name).at_field("springs.body", error.to_string())
        }
        ChangeError::NoCloth => refused.at_field("springs", error.to_string()),
        ChangeError::NotPinned { particle } => {
            refused.with("particle", particle).at_field("pins.particle", error.to_string())
        }
        ChangeError::NoSuchParticle { particle, count } => refused
            .with("particle", particle)
            .with("particle_count", count)
            .at_field("pins.particle", error.to_string()),
    }
}

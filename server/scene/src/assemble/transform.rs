//! Moves a mesh: x' = rotate(scale x) + translate.

use nappe_sim::mesh::TriangleMesh;

use super::body::Context;
use crate::{
    body::{Rotate, Transform},
    error::{Fault, SceneError},
    fill::Placement,
    source::{Path, Source},
};

pub(super) fn apply(context: &Context<'_>, mesh: &mut TriangleMesh) -> Result<(), SceneError> {
    let transform = context.body.transform;
    if transform == Transform::default() {
        return Ok(());
    }
    let (scale, placement) = placement(&transform, &context.path.key("transform"), context.source)?;
    for point in &mut mesh.points {
        *point = placement.apply(point.map(|c| c * scale));
    }
    Ok(())
}

/// The scale of a transform, and what it does after that.
pub(super) fn placement(
    transform: &Transform,
    path: &Path,
    source: &Source,
) -> Result<(f64, Placement), SceneError> {
    let rotation = rotation(transform.rotate.as_ref(), path, source)?;
    Ok((transform.scale, Placement { rotation, shift: transform.translate }))
}

/// The matrix of a rotation; `path` is what holds it.
pub(super) fn rotation(
    rotate: Option<&Rotate>,
    path: &Path,
    source: &Source,
) -> Result<[[f64; 3]; 3], SceneError> {
    let Some(rotate) = rotate else { return Ok([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) };
    matrix(rotate).ok_or_else(|| {
        let axis = path.key("rotate").key("axis");
        source.error(Fault::OutOfRange, &axis, "is zero: an axis needs a direction")
    })
}

/// Rodrigues' formula: R = cos I + sin [u] + (1 - cos) u u^T. None for an axis of length 0.
fn matrix(rotate: &Rotate) -> Option<[[f64; 3]; 3]> {
    let length = rotate.axis.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length == 0.0 {
        return None;
    }
    let [x, y, z] = rotate.axis.map(|c| c / length);
    let (sin, cos) = sin_cos_degrees(rotate.degrees);
    let d = 1.0 - cos;
    Some([
        [cos + d * x * x, d * x * y - sin * z, d * x * z + sin * y],
        [d * x * y + sin * z, cos + d * y * y, d * y * z - sin * x],
        [d * x * z - sin * y, d * y * z + sin * x, cos + d * z * z],
    ])
}

/// Quarter turns are exact, so that a sheet set upright is flat to the last bit.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let turn = degrees.rem_euclid(360.0);
    match turn {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        _ => libm::sincos(turn.to_radians()),
    }
}

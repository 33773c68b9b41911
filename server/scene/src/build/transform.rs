//! Moves a mesh: x' = rotate(scale x) + translate.

use nappe_sim::mesh::TriangleMesh;

use super::body::Context;
use crate::{
    body::{Rotate, Transform},
    error::{Fault, SceneError},
};

pub(super) fn apply(context: &Context<'_>, mesh: &mut TriangleMesh) -> Result<(), SceneError> {
    let transform = context.body.transform;
    if transform == Transform::default() {
        return Ok(());
    }
    let matrix = match transform.rotate {
        Some(rotate) => rotation(&rotate).ok_or_else(|| {
            let path = context.path.key("transform").key("rotate").key("axis");
            context.source.error(Fault::OutOfRange, &path, "is zero: an axis needs a direction")
        })?,
        None => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    };
    for point in &mut mesh.points {
        let x = point.map(|c| c * transform.scale);
        for i in 0..3 {
            let row = matrix[i];
            point[i] = row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + transform.translate[i];
        }
    }
    Ok(())
}

/// Rodrigues' formula: R = cos I + sin [u] + (1 - cos) u u^T. None for an axis of length 0.
fn rotation(rotate: &Rotate) -> Option<[[f64; 3]; 3]> {
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
        _ => turn.to_radians().sin_cos(),
    }
}

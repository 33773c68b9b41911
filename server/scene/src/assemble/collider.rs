//! A collider of a scene to a shape with unit directions.

use nappe_sim::collide::{Collider, Shape};

use super::transform;
use crate::{
    error::{Fault, SceneError},
    scene::{ColliderText, ShapeText},
    source::{Path, Source},
};

/// Builds a collider; `path` is where it stands.
pub(super) fn build(text: &ColliderText, path: &Path, source: &Source) -> Result<Collider, SceneError> {
    let shape = match &text.shape {
        &ShapeText::Plane { point, normal } => {
            let normal = direction(normal, "normal", &path.key("plane"), source)?;
            Shape::Plane { point, normal }
        }
        &ShapeText::Sphere { center, radius } => Shape::Sphere { center, radius },
        &ShapeText::Capsule { start, end, radius } => {
            apart(start, end, &path.key("capsule"), source)?;
            Shape::Capsule { start, end, radius }
        }
        ShapeText::Box { center, size, rotate } => {
            let rotation = transform::rotation(rotate.as_ref(), &path.key("box"), source)?;
            // The rotation's columns are where it takes the axes.
            let axes = [0, 1, 2].map(|axis| rotation.map(|row| row[axis]));
            Shape::Box { center: *center, half_extent: size.map(|edge| 0.5 * edge), axes }
        }
        &ShapeText::Cylinder { start, end, radius } => {
            apart(start, end, &path.key("cylinder"), source)?;
            Shape::Cylinder { start, end, radius }
        }
        &ShapeText::HalfPipe { point, axis, up, radius } => {
            let path = path.key("half_pipe");
            let axis = direction(axis, "axis", &path, source)?;
            let up = direction(up, "up", &path, source)?;
            Shape::HalfPipe { point, axis, up: square(axis, up, &path, source)?, radius }
        }
    };
    Ok(Collider {
        name: text.name.clone(),
        shape,
        velocity: text.velocity,
        friction: text.friction,
        restitution: text.restitution,
        margin: text.margin,
        contact: text.contact,
    })
}

/// The unit vector along a direction.
fn direction(v: [f64; 3], field: &str, path: &Path, source: &Source) -> Result<[f64; 3], SceneError> {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length == 0.0 {
        let message = match field {
            "normal" => "is zero: a normal needs a direction",
            "axis" => "is zero: an axis needs a direction",
            _ => "is zero: a direction needs a length above 0",
        };
        return Err(source.error(Fault::OutOfRange, &path.key(field), message));
    }
    Ok(v.map(|c| c / length))
}

/// The unit vector nearest to `up` at right angles to `axis`; both are unit vectors.
fn square(axis: [f64; 3], up: [f64; 3], path: &Path, source: &Source) -> Result<[f64; 3], SceneError> {
    let along: f64 = (0..3).map(|c| axis[c] * up[c]).sum();
    let across = [0, 1, 2].map(|c| up[c] - along * axis[c]);
    let length = across.iter().map(|c| c * c).sum::<f64>().sqrt();
    // Nearer to the axis than that, its direction is mostly rounding.
    if length < 1e-6 {
        let message = "runs along the axis; allowed: a direction across it, that of the opening";
        return Err(source.error(Fault::Inconsistent, &path.key("up"), message));
    }
    Ok(across.map(|c| c / length))
}

fn apart(start: [f64; 3], end: [f64; 3], path: &Path, source: &Source) -> Result<(), SceneError> {
    if start == end {
        let message = "is where it starts; allowed: another point, or a sphere";
        return Err(source.error(Fault::Inconsistent, &path.key("end"), message));
    }
    Ok(())
}

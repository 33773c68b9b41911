//! What moves a mesh or a solid: x' = rotate(scale x) + translate, as a scene says it and as a matrix.

use serde::{Deserialize, Serialize};

use crate::{
    error::{ErrorKind, SceneError},
    location::Location,
    schema::{Alternatives, DIRECTION, LENGTH, Presence, Range, Section, ValueKind, key},
};

use Presence::{Absent, Default as Preset, Required};
use ValueKind::{Number, Table, Vector};

/// Moves a mesh: x' = rotate(scale x) + translate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Transform {
    /// Factor on every coordinate.
    pub scale: f64,
    /// Rotation about the origin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotate: Option<Rotate>,
    /// Shift (m).
    pub translate: [f64; 3],
}

impl Default for Transform {
    fn default() -> Self {
        Self { scale: 1.0, rotate: None, translate: [0.0; 3] }
    }
}

/// A right-handed rotation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rotate {
    /// Axis, of any length but 0.
    pub axis: [f64; 3],
    /// Angle (degrees).
    pub degrees: f64,
}

#[rustfmt::skip] // one line per key
pub(crate) static TRANSFORM: Section = Section {
    name: "body.transform, figure.transform, snow.object.transform, collider.mesh.transform",
    about: "Moves what a body, a figure, an object of snow or a collider is made from: x' = rotate(scale x) + translate.",
    keys: &[
        key("scale", Number(Range(1e-6, 1e6)), "", Preset("1.0"), "factor on every coordinate"),
        key("rotate", Table(&ROTATE), "", Absent("no rotation"), "rotation about the origin, after scaling"),
        key("translate", Vector(LENGTH), "m", Preset("[0.0, 0.0, 0.0]"), "shift"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
pub(crate) static ROTATE: Section = Section {
    name: "body.transform.rotate, collider.box.rotate",
    about: "A rotation, right-handed.",
    keys: &[
        key("axis", Vector(DIRECTION), "", Required, "axis, not zero; its length does not matter"),
        key("degrees", Number(Range(-360.0, 360.0)), "degrees", Required, "angle; quarter turns are exact about the coordinate axes"),
    ],
    alternatives: Alternatives::None,
};

/// A rotation and a shift: x' = rotation x + shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RigidMotion {
    pub(crate) rotation: [[f64; 3]; 3],
    pub(crate) shift: [f64; 3],
}

impl RigidMotion {
    /// Where a point goes.
    pub(crate) fn apply(&self, point: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| {
            let row = self.rotation[i];
            row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + self.shift[i]
        })
    }

    /// Where a point came from.
    pub(crate) fn undo(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = [0, 1, 2].map(|i| point[i] - self.shift[i]);
        let [a, b, c] = self.rotation;
        [0, 1, 2].map(|i| a[i] * x + b[i] * y + c[i] * z)
    }
}

impl Transform {
    /// The rotation and the shift, which come after the scale; `at` is where the transform stands.
    pub(crate) fn motion(&self, at: &Location<'_>) -> Result<RigidMotion, SceneError> {
        Ok(RigidMotion { rotation: rotation(self.rotate.as_ref(), at)?, shift: self.translate })
    }
}

/// The matrix of a rotation, or of none; `at` is the table that holds `rotate`.
pub(crate) fn rotation(rotate: Option<&Rotate>, at: &Location<'_>) -> Result<[[f64; 3]; 3], SceneError> {
    let Some(rotate) = rotate else { return Ok([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) };
    matrix(rotate).ok_or_else(|| {
        at.key("rotate").key("axis").error(ErrorKind::OutOfRange, "is zero: an axis needs a direction")
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

//! What an HTML recording says once: the scene, its bodies and what joins their particles, colliders.
//!
//! Enters: topology and the session. Leaves: the head of the file, in JSON, as `docs/frames.md` describes it.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use nappe_client::{
    Body, Collider, Shape, Topology, components, mesh_triangles,
    packed::{Effort, pack},
    v1,
};
use nappe_scene::printable;
use serde_json::{Value, json};

use crate::words::error::{CliError, Result};

/// Indices in a file are below this, as all whole numbers of packed arrays.
const INDEX_LIMIT: usize = 1 << 23;

/// What is known of a recording before its first frame.
#[derive(Clone, Debug, Default)]
pub(super) struct About {
    /// The session's title, or its id where it has none.
    pub(super) title: String,
    /// The text of the scene, where the command has it.
    pub(super) scene: Option<String>,
    /// Length of a step (s).
    pub(super) dt_seconds: f64,
    /// `f32` or `f64`.
    pub(super) precision: String,
}

/// The head of the file.
///
/// # Errors
/// When there are too many particles for it.
pub(super) fn head(
    about: &About,
    topology: &Topology,
    color: Option<&str>,
    bound: Option<f64>,
) -> Result<Value> {
    if topology.particle_count >= INDEX_LIMIT {
        return Err(CliError::failure(format!(
            "{} particles are too many for an HTML file, which holds less than {INDEX_LIMIT}",
            topology.particle_count
        )));
    }
    Ok(json!({
        "format": 1,
        "program": concat!("nappe ", env!("CARGO_PKG_VERSION")),
        "title": about.title,
        "scene": about.scene,
        "particles": topology.particle_count,
        "dt_seconds": about.dt_seconds,
        "precision": about.precision,
        "bound": bound,
        "color": color,
        "bodies": topology.bodies.iter().map(body).collect::<Vec<_>>(),
        "colliders": topology.colliders.iter().filter_map(collider).collect::<Vec<_>>(),
    }))
}

fn body(body: &Body) -> Value {
    json!({
        "name": printable(&body.name),
        "first_particle": body.first_particle,
        "particle_count": body.particle_count,
        "triangles": indices(&body.triangles),
        "springs": indices(&body.springs),
        "pins": body.pins,
        "color": body.color,
    })
}

/// Indices as a packed array, a triangle or a spring in place of a particle; nothing where there are none.
fn indices<const N: usize>(elements: &[[u32; N]]) -> Option<Value> {
    let numbers: Vec<i32> = elements.as_flattened().iter().map(|&index| index as i32).collect();
    let data = STANDARD.encode(pack(&numbers, N, None, Effort::Small));
    (!elements.is_empty()).then(|| json!({ "count": elements.len(), "data": data }))
}

/// A collider, unless its shape is newer than this program.
fn collider(collider: &Collider) -> Option<Value> {
    let at = |vector: Option<v1::Vector3>| components(vector);
    let shape = match collider.shape.as_ref()? {
        Shape::Plane(s) => json!({ "kind": "plane", "point": at(s.point), "normal": at(s.normal) }),
        Shape::Sphere(s) => json!({ "kind": "sphere", "center": at(s.center), "radius": s.radius }),
        Shape::Capsule(s) => {
            json!({ "kind": "capsule", "start": at(s.start), "end": at(s.end), "radius": s.radius })
        }
        Shape::Box(s) => json!({
            "kind": "box", "center": at(s.center), "half_extent": at(s.half_extent),
            "axis_x": at(s.axis_x), "axis_y": at(s.axis_y),
        }),
        Shape::Cylinder(s) => {
            json!({ "kind": "cylinder", "start": at(s.start), "end": at(s.end), "radius": s.radius })
        }
        Shape::Mesh(s) => json!({
            "kind": "mesh", "points": STANDARD.encode(&s.points_f32), "triangles": indices(&mesh_triangles(s)),
            "origin": at(s.origin),
        }),
        Shape::HalfPipe(s) => json!({
            "kind": "half_pipe", "point": at(s.point), "axis": at(s.axis), "up": at(s.up), "radius": s.radius,
        }),
    };
    Some(json!({ "name": collider.name, "velocity": collider.velocity, "shape": shape }))
}

//! A scene's text to all that a simulation is made from.
//!
//! Enters: a text, uploaded meshes, limits. Leaves: the scene as read and as built, or the place
//! and kind of its first error.

use nappe_scene::{Built, Fault, Scene, SceneError, SceneLimits};

use super::mesh_store::MeshStore;
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
};

/// Reads a scene's text and builds what it describes; `file` names it in messages.
///
/// # Errors
/// The place and kind of the first error in the scene.
pub(crate) fn assemble_scene(
    text: &str,
    file: &str,
    meshes: &MeshStore,
    limits: &Limits,
) -> Result<(Scene, Built), ServiceError> {
    let scene = Scene::parse(text, file).map_err(|error| service_error(&error))?;
    let bounds = SceneLimits { max_particles: limits.max_particles, max_springs: limits.max_springs };
    let built = scene.build(meshes, &bounds).map_err(|error| service_error(&error))?;
    Ok((scene, built))
}

/// The metadata key is `fault` for clients that read it; it names the kind of the error.
fn service_error(error: &SceneError) -> ServiceError {
    let reason = match error.fault {
        Fault::TooLarge => Reason::SceneTooLarge,
        Fault::MeshNotFound => Reason::MeshNotFound,
        _ => Reason::InvalidScene,
    };
    let refused = ServiceError::new(reason, error.to_string()).with("fault", error.fault.reason());
    let refused = if error.line > 0 { refused.with("line", error.line) } else { refused };
    let refused = if error.column > 0 { refused.with("column", error.column) } else { refused };
    if error.field.is_empty() {
        refused
    } else {
        refused.with("field", &error.field).at_field(format!("scene_text: {}", error.field), &error.message)
    }
}

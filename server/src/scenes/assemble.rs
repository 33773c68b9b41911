//! A scene's text to all that a simulation is made from.
//!
//! Enters: a text, uploaded meshes, limits. Leaves: the scene as read and as built, or the place
//! and kind of each of its errors.

use nappe_scene::{Built, ErrorKind, Scene, SceneErrors, SceneLimits};

use super::mesh_store::MeshStore;
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
};

/// Reads a scene's text and builds what it describes; `file` names it in messages.
///
/// # Errors
/// What is wrong with the scene, the first error first.
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

/// The first error decides the reason and stands in the metadata, where its kind is called `fault`; each
/// error is a violation of its key.
fn service_error(errors: &SceneErrors) -> ServiceError {
    let first = errors.first();
    let reason = match first.kind {
        ErrorKind::TooLarge => Reason::SceneTooLarge,
        ErrorKind::MeshNotFound => Reason::MeshNotFound,
        _ => Reason::InvalidScene,
    };
    let refused = ServiceError::new(reason, errors.to_string()).with("fault", first.kind.reason());
    let refused = if first.line > 0 { refused.with("line", first.line) } else { refused };
    let refused = if first.column > 0 { refused.with("column", first.column) } else { refused };
    let refused = if first.key.is_empty() { refused } else { refused.with("field", &first.key) };

    errors.iter().filter(|error| !error.key.is_empty()).fold(refused, |refused, error| {
        refused.at_field(format!("scene_text: {}", error.key), &error.message)
    })
}

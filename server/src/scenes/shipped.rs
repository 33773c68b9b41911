//! The scenes that the server ships, by name.

use nappe_scene::{shipped_scenes, suggestion};

use crate::error::{Reason, ServiceError};

/// Names of the shipped scenes, in their order.
pub(crate) fn scene_names() -> Vec<String> {
    shipped_scenes().iter().map(|(name, _)| (*name).to_owned()).collect()
}

/// The text of a shipped scene.
///
/// # Errors
/// If there is none of this name.
pub(crate) fn shipped_scene(name: &str) -> Result<&'static str, ServiceError> {
    shipped_scenes().iter().find(|(known, _)| *known == name).map(|(_, text)| *text).ok_or_else(|| {
        let near = suggestion(name, shipped_scenes().iter().map(|(known, _)| *known));
        ServiceError::new(Reason::SceneNotFound, format!("no scene is named '{name}'; {near}"))
            .with("scene", name)
            .with("known", scene_names().join(", "))
    })
}

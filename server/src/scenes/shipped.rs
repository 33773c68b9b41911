//! The scenes that the server ships, by name.

use nappe_scene::shipped_scenes;

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
        let known = scene_names().join(", ");
        ServiceError::new(Reason::SceneNotFound, format!("no scene is named '{name}'; there are: {known}"))
            .with("scene", name)
            .with("known", known)
    })
}

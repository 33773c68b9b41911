//! Thickness of cloth beside the rest of its scene: whether it can be kept, and what is odd about it.

use nappe_sim::{
    cloth::{ClothSettings, Network, SurfaceSettings},
    math::number,
    world::BodySetup,
};

use super::inside::Solid;
use crate::{error::SceneError, location::Location};

/// Refuses a thickness that the cloth of the body at `at` cannot keep when it is stepped so.
pub(super) fn check(
    network: &Network,
    settings: &ClothSettings,
    at: &Location<'_>,
) -> Result<(), SceneError> {
    match network.invalid_thickness(settings) {
        Some(message) => at.key("thickness").inconsistent(message),
        None => Ok(()),
    }
}

/// What is odd about how surfaces meet each other and colliders, in sentences for the user.
pub(super) fn warnings(bodies: &[BodySetup], solids: &[Solid<'_>], contact: SurfaceSettings) -> Vec<String> {
    let mut warnings = Vec::new();
    let thick = || bodies.iter().filter(|body| body.network.thickness > 0.0);
    let default = SurfaceSettings::default();
    let keys =
        [("friction", contact.friction, default.friction), ("recovery", contact.recovery, default.recovery)];
    for (key, value, default) in keys {
        if thick().next().is_none() && value.to_bits() != default.to_bits() {
            warnings.push(format!("contact.{key} has no effect: no body has a thickness"));
        }
    }
    for body in thick() {
        let thickness = body.network.thickness;
        let thin = |solid: &&Solid<'_>| solid.collider.margin < 0.5 * thickness;
        if let Some(solid) = solids.iter().find(thin) {
            let (collider, margin) = (&solid.collider.name, solid.collider.margin);
            warnings.push(format!(
                "body '{}': it has a thickness of {} m, and the margin of collider '{collider}' is {} m, below half of that: \
                 the collider shows through the cloth that lies on it",
                body.name,
                number(thickness),
                number(margin),
            ));
        }
    }
    warnings
}

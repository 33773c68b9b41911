//! Whether an object of snow can be attached to the collider that it names.

use nappe_sim::{collide::Contact, snow::SnowObject};

use super::super::inside::Solid;
use crate::{
    error::{ErrorKind, SceneError, suggestion},
    location::Location,
    snow::SnowBody,
};

/// Checks what an object is attached to; `at` is where the object stands.
pub(super) fn check(
    text: &SnowBody,
    object: &SnowObject,
    cell: f64,
    solids: &[Solid<'_>],
    at: &Location<'_>,
) -> Result<(), SceneError> {
    let Some(name) = &text.attach else { return Ok(()) };
    let at = at.key("attach");
    let Some(Solid { collider, .. }) = solids.iter().find(|solid| solid.collider.name == *name) else {
        let hint = suggestion(name, solids.iter().map(|solid| solid.collider.name.as_str()));
        return at.inconsistent(format!("is '{name}', and no collider is named so; {hint}"));
    };
    if collider.contact != Contact::Sticky {
        return at.inconsistent(format!("needs contact = \"sticky\" of the collider '{name}'"));
    }
    if collider.way.is_some() || collider.velocity != [0.0; 3] {
        return at.inconsistent(format!("needs a collider that stands, and '{name}' moves"));
    }
    if object.material.plasticity.is_some() {
        return at.inconsistent(
            "needs a material that cannot yield: allowed are the presets elastic and brasseur_neo_hookean, and \
             plastic = false",
        );
    }
    let reach = 0.5 * cell;
    if !object.x.iter().any(|x| collider.distance(*x, 0.0).0.abs() <= reach) {
        let message = format!("needs particles within half a cell ({reach} m) of the surface of '{name}'");
        return Err(at.error(ErrorKind::OutOfRange, message));
    }
    Ok(())
}

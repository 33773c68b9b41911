//! What an object of snow is made of: a preset, and what its scene says instead.

use nappe_sim::snow::{Material, Plasticity, Preset};

use crate::{
    error::{Fault, SceneError},
    location::Place,
    snow::MaterialText,
};

/// Density at rest (kg/m³) and material.
pub(super) fn material(text: &MaterialText, place: &Place<'_>) -> Result<(f64, Material), SceneError> {
    let Some(preset) = Preset::from_name(&text.preset) else {
        let message = format!("is '{}', which is no preset", text.preset);
        return Err(place.error(Fault::OutOfRange, "preset", message));
    };
    let base = preset.material;
    let material = Material {
        law: text.law.unwrap_or(base.law),
        young: text.young.unwrap_or(base.young),
        poisson: text.poisson.unwrap_or(base.poisson),
        plasticity: plasticity(text, base.plasticity, place)?,
    };
    // What the ranges of single fields do not say.
    match material.fault() {
        Some(message) => Err(place.error(Fault::OutOfRange, "jp_range", message)),
        None => Ok((text.density.unwrap_or(preset.density), material)),
    }
}

fn plasticity(
    text: &MaterialText,
    base: Option<Plasticity>,
    place: &Place<'_>,
) -> Result<Option<Plasticity>, SceneError> {
    let given = [
        ("critical_compression", text.critical_compression.is_some()),
        ("critical_stretch", text.critical_stretch.is_some()),
        ("hardening", text.hardening.is_some()),
        ("jp_range", text.jp_range.is_some()),
    ];
    let given = given.iter().find(|(_, given)| *given).map(|(name, _)| *name);
    match (text.plastic, base, given) {
        (Some(false), _, Some(field)) => place.clash(field, "does not go with plastic = false"),
        (Some(true), None, _) => {
            let message =
                format!("is true, and the preset '{}' has no yield; take another preset", text.preset);
            place.clash("plastic", message)
        }
        (None, None, Some(field)) => {
            let message = format!("does not go with the preset '{}', which has no yield", text.preset);
            place.clash(field, message)
        }
        (Some(false), ..) | (_, None, _) => Ok(None),
        (_, Some(base), _) => Ok(Some(Plasticity {
            critical_compression: text.critical_compression.unwrap_or(base.critical_compression),
            critical_stretch: text.critical_stretch.unwrap_or(base.critical_stretch),
            hardening: text.hardening.unwrap_or(base.hardening),
            jp_range: text.jp_range.unwrap_or(base.jp_range),
        })),
    }
}

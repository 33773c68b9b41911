//! What an object of snow is made of: a preset, and what its scene says instead.

use nappe_sim::snow::{Material, Plasticity, Preset};

use crate::{
    error::{ErrorKind, SceneError},
    location::Location,
    snow::MaterialText,
};

/// Density at rest (kg/m³) and material.
pub(super) fn material(text: &MaterialText, at: &Location<'_>) -> Result<(f64, Material), SceneError> {
    let Some(preset) = Preset::from_name(&text.preset) else {
        let message = format!("is '{}', which is no preset", text.preset);
        return Err(at.key("preset").error(ErrorKind::OutOfRange, message));
    };

    let base = preset.material;
    let material = Material {
        law: text.law.unwrap_or(base.law),
        young: text.young.unwrap_or(base.young),
        poisson: text.poisson.unwrap_or(base.poisson),
        plasticity: plasticity(text, base.plasticity, at)?,
    };

    // What the ranges of single fields do not say.
    match material.error() {
        Some(message) => Err(at.key("plastic_ratio_range").error(ErrorKind::OutOfRange, message)),
        None => Ok((text.density.unwrap_or(preset.density), material)),
    }
}

fn plasticity(
    text: &MaterialText,
    base: Option<Plasticity>,
    at: &Location<'_>,
) -> Result<Option<Plasticity>, SceneError> {
    let given = [
        ("critical_compression", text.critical_compression.is_some()),
        ("critical_stretch", text.critical_stretch.is_some()),
        ("hardening", text.hardening.is_some()),
        ("plastic_ratio_range", text.plastic_ratio_range.is_some()),
    ];
    let given = given.iter().find(|(_, given)| *given).map(|(name, _)| *name);
    match (text.plastic, base, given) {
        (Some(false), _, Some(key)) => at.key(key).inconsistent("does not go with plastic = false"),
        (Some(true), None, _) => {
            let message =
                format!("is true, and the preset '{}' has no yield; take another preset", text.preset);
            at.key("plastic").inconsistent(message)
        }
        (None, None, Some(key)) => {
            let message = format!("does not go with the preset '{}', which has no yield", text.preset);
            at.key(key).inconsistent(message)
        }
        (Some(false), ..) | (_, None, _) => Ok(None),
        (_, Some(base), _) => Ok(Some(Plasticity {
            critical_compression: text.critical_compression.unwrap_or(base.critical_compression),
            critical_stretch: text.critical_stretch.unwrap_or(base.critical_stretch),
            hardening: text.hardening.unwrap_or(base.hardening),
            plastic_ratio_range: text.plastic_ratio_range.unwrap_or(base.plastic_ratio_range),
        })),
    }
}

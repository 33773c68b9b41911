//! Terms of snow: how it yields and hardens, its noise, its share of FLIP, drag and wind.

use nappe_sim::snow::Preset;

use super::term::{Removal, SceneTerm};
use crate::snow::{MaterialText, Snow, SnowBody, TransferName};

/// How it yields and hardens, noise, the share of FLIP, drag, and the wind, if any of its velocities (m/s) is one, which acts
/// through it.
pub(super) fn of_snow(snow: &Snow, mut winds: impl Iterator<Item = [f64; 3]>) -> Vec<SceneTerm> {
    let Snow {
        cell: _,
        kernel: _,
        transfer,
        flip,
        flip_time: _,
        advection: _,
        safety: _,
        substep: _,
        unchecked: _,
        beta: _,
        solver: _,
        max_substeps: _,
        ballistic_below: _,
        max_energy: _,
        drag,
        objects,
    } = snow;
    let mut has = [false; 4];
    for object in objects {
        let SnowBody {
            name: _,
            source: _,
            transform: _,
            sampling: _,
            jitter: _,
            particles_per_cell: _,
            particles: _,
            seed: _,
            velocity: _,
            angular_velocity: _,
            material,
            density_noise,
            stiffness_noise,
            noise_length: _,
            volume: _,
            overlap: _,
            attach: _,
        } = object;
        let hardening = hardening(material);
        has[0] |= hardening.is_some();
        has[1] |= hardening.is_some_and(|hardening| hardening > 0.0);
        has[2] |= *density_noise > 0.0;
        has[3] |= *stiffness_noise > 0.0;
    }
    let terms = [
        SceneTerm::new("plasticity", Removal::Plasticity),
        SceneTerm::new("hardening", Removal::Hardening),
        SceneTerm::new("noise of density", Removal::DensityNoise),
        SceneTerm::new("noise of stiffness", Removal::StiffnessNoise),
    ];
    let mut terms: Vec<SceneTerm> =
        terms.into_iter().zip(has).filter(|(_, has)| *has).map(|(term, _)| term).collect();
    if *transfer == TransferName::PicFlip && flip.is_none_or(|share| share > 0.0) {
        terms.push(SceneTerm::new("share of FLIP", Removal::Flip));
    }
    if *drag > 0.0 {
        terms.push(SceneTerm::new("drag", Removal::SnowDrag));
        if winds.any(|wind| wind != [0.0; 3]) {
            terms.push(SceneTerm::new("wind", Removal::Wind));
        }
    }
    terms
}

/// The hardening of a material; none where it does not yield.
pub(super) fn hardening(material: &MaterialText) -> Option<f64> {
    let MaterialText {
        preset,
        law: _,
        young: _,
        poisson: _,
        density: _,
        critical_compression: _,
        critical_stretch: _,
        hardening,
        plastic_ratio_range: _,
        plastic,
    } = material;
    let base = Preset::from_name(preset)?.material.plasticity?;
    (*plastic != Some(false)).then(|| hardening.unwrap_or(base.hardening))
}

/// Makes a material elastic that yields, and leaves out what says how.
pub(super) fn make_elastic(material: &mut MaterialText) {
    if hardening(material).is_some() {
        material.plastic = Some(false);
        (material.critical_compression, material.critical_stretch) = (None, None);
        (material.hardening, material.plastic_ratio_range) = (None, None);
    }
}

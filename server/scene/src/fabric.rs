//! Fabrics by name: what a cloth weighs per area, and how it resists stretching, shear and bending, in SI units.
//!
//! Reads a preset and what a scene says instead; gives masses and laws of elements, which depend on no mesh. Where each number
//! comes from stands in docs/laws/fabrics.md.

use nappe_sim::cloth::ElementKind;
use serde::{Deserialize, Serialize};

use crate::element_law::{ElementLaw, Stiffness, WarpText};

/// Damping of stretch and shear over that of bending, as times: threads are stiff, and their damping would bound explicit steps.
const OF_STRETCH: f64 = 1e-3;

/// The numbers of a fabric, which depend on no mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fabric {
    /// Its name in scene files.
    pub name: &'static str,
    /// Mass per area (kg/m²).
    pub density: f64,
    /// Stiffness per width along the warp and along the weft (N/m).
    pub stretch: [f64; 2],
    /// Stiffness per width against shear (N/m).
    pub shear: f64,
    /// Bending stiffness per width (N m).
    pub bending: f64,
    /// Damping of bending in its stiffness (s).
    pub damping: f64,
    /// How thick it is (m): what a body's `thickness` may be where its surface is to keep from itself.
    pub thickness: f64,
}

impl Fabric {
    /// Every fabric, from the softest to the stiffest to bend.
    #[rustfmt::skip] // one line per fabric
    pub const ALL: [Self; 6] = [
        Self { name: "silk", density: 0.069, stretch: [8200.0, 6100.0], shear: 22.0, bending: 2e-6, damping: 0.01, thickness: 0.15e-3 },
        Self { name: "jersey", density: 0.18, stretch: [1600.0, 820.0], shear: 34.0, bending: 2e-6, damping: 0.01, thickness: 0.6e-3 },
        Self { name: "cotton", density: 0.15, stretch: [9800.0, 4900.0], shear: 56.0, bending: 6e-6, damping: 0.01, thickness: 0.3e-3 },
        Self { name: "wool", density: 0.235, stretch: [4900.0, 4100.0], shear: 45.0, bending: 12e-6, damping: 0.01, thickness: 0.5e-3 },
        Self { name: "denim", density: 0.324, stretch: [9000.0, 7000.0], shear: 140.0, bending: 63e-6, damping: 0.01, thickness: 0.6e-3 },
        Self { name: "leather", density: 0.6, stretch: [16000.0, 16000.0], shear: 5000.0, bending: 80e-6, damping: 0.01, thickness: 0.8e-3 },
    ];

    /// The fabric of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|fabric| fabric.name == name)
    }
}

/// A fabric as a body has it written: a preset, and what differs from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FabricText {
    /// Name of the preset.
    pub preset: String,
    /// Where its warp runs; none: along the first texture coordinate, where the mesh has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warp: Option<WarpText>,
    /// Mass per area (kg/m²); here and below, none: as the preset has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Stiffness per width along the warp and along the weft (N/m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stretch: Option<[f64; 2]>,
    /// Stiffness per width against shear (N/m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear: Option<f64>,
    /// Bending stiffness per width (N m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending: Option<f64>,
    /// Damping of bending in its stiffness (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<f64>,
}

impl FabricText {
    /// The fabric; none where the preset is not there, which the keys refuse.
    pub fn fabric(&self) -> Option<Fabric> {
        let base = Fabric::from_name(&self.preset)?;
        Some(Fabric {
            density: self.density.unwrap_or(base.density),
            stretch: self.stretch.unwrap_or(base.stretch),
            shear: self.shear.unwrap_or(base.shear),
            bending: self.bending.unwrap_or(base.bending),
            damping: self.damping.unwrap_or(base.damping),
            ..base
        })
    }

    /// A membrane and a plate.
    pub(crate) fn laws(&self) -> Vec<ElementLaw> {
        let Some(Fabric { stretch: [warp, weft], shear, bending, damping, .. }) = self.fabric() else {
            return Vec::new();
        };
        let membrane = ElementLaw {
            name: ElementKind::Membrane,
            stiffness: Stiffness::Three([warp, weft, shear]),
            damping: OF_STRETCH * damping * warp.max(weft).max(shear),
            warp: self.warp,
        };
        let plate = ElementLaw {
            name: ElementKind::Plate,
            stiffness: Stiffness::One(bending),
            damping: damping * bending,
            warp: None,
        };
        vec![membrane, plate]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fabric_is_a_membrane_and_a_plate_with_what_differs_from_its_preset() {
        let silk = Fabric::from_name("silk").expect("a preset");
        let text = FabricText {
            preset: "silk".to_owned(),
            warp: None,
            density: None,
            stretch: None,
            shear: Some(30.0),
            bending: Some(3e-6),
            damping: None,
        };
        let fabric = text.fabric().expect("a preset");
        assert_eq!(fabric, Fabric { shear: 30.0, bending: 3e-6, ..silk });
        let [membrane, plate] = text.laws()[..] else { panic!("two laws") };
        assert_eq!(membrane.stiffness, Stiffness::Three([silk.stretch[0], silk.stretch[1], 30.0]));
        assert!((membrane.damping - 1e-5 * silk.stretch[0]).abs() < 1e-12, "{}", membrane.damping);
        assert_eq!((plate.name, plate.stiffness), (ElementKind::Plate, Stiffness::One(3e-6)));
        assert!((plate.damping - 3e-8).abs() < 1e-20);
    }

    #[test]
    fn fabrics_fold_at_lengths_of_cloth() {
        for Fabric { name, density, bending, stretch, shear, .. } in Fabric::ALL {
            let fold = (bending / (9.81 * density)).cbrt();
            assert!((0.008..0.03).contains(&fold), "{name}: {fold} m");
            assert!(
                stretch.into_iter().all(|stretch| stretch > shear),
                "{name}: threads are stiffer than shear"
            );
        }
    }
}

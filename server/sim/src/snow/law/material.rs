//! What snow is made of: elastic law, hardening, yield limits; presets with their sources.

use serde::{Deserialize, Serialize};

use crate::names::names;

/// How elastic energy depends on the deformation gradient.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Law {
    /// psi = mu |F - R|² + lambda/2 (J - 1)² (Stomakhin et al. 2012, 2013).
    #[default]
    FixedCorotated,
    /// psi = mu/2 (|F|² - 3) - mu ln J + lambda/2 (ln J)². Below J = [`Law::MIN_J`] the
    /// logarithm goes on as its tangent, so that it is defined for singular and inverted F.
    NeoHookean,
}

names!(Law { FixedCorotated: "fixed_corotated", NeoHookean: "neo_hookean" });

impl Law {
    /// Volume ratio below which the logarithm of the Neo-Hookean law is replaced by its tangent.
    pub const MIN_J: f64 = 1e-3;
}

/// Yield and hardening of snow (Stomakhin et al. 2013, section 5).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plasticity {
    /// Critical compression: singular values of F stay above 1 - theta_c.
    pub critical_compression: f64,
    /// Critical stretch: singular values of F stay below 1 + theta_s.
    pub critical_stretch: f64,
    /// Hardening xi: stiffness grows as exp(xi (1 - J_P)).
    pub hardening: f64,
    /// Range that J_P is kept in: without it compaction raises the stiffness without bound.
    pub plastic_ratio_range: [f64; 2],
}

/// What snow is made of: its elastic law, and where it yields.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// How energy depends on deformation.
    pub law: Law,
    /// Young's modulus at J_P = 1 (Pa).
    pub young: f64,
    /// Poisson's ratio, from 0 and below 1/2.
    pub poisson: f64,
    /// Yield and hardening; none: elastic.
    pub plasticity: Option<Plasticity>,
}

/// A material with a name, a density and where its numbers come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset {
    /// Its name in scene files.
    pub name: &'static str,
    /// Who uses these numbers.
    pub source: &'static str,
    /// Density at rest (kg/m³).
    pub density: f64,
    /// Law, stiffness, yield limits and hardening.
    pub material: Material,
}

impl Material {
    /// Lamé's first coefficient at J_P = 1 (Pa).
    pub fn lambda(&self) -> f64 {
        self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
    }

    /// Shear modulus at J_P = 1 (Pa).
    pub fn mu(&self) -> f64 {
        self.young / (2.0 * (1.0 + self.poisson))
    }

    /// What is wrong with the numbers, as a sentence.
    pub fn error(&self) -> Option<String> {
        let above = |value: f64| value.is_finite() && value > 0.0;
        if !above(self.young) {
            return Some(format!("Young's modulus is {} Pa: a finite number above 0 is needed", self.young));
        }

        if !(0.0..=0.49).contains(&self.poisson) {
            return Some(format!("Poisson's ratio is {}: 0 to 0.49 is needed", self.poisson));
        }

        let plasticity = self.plasticity?;
        let Plasticity { critical_compression, critical_stretch, hardening, .. } = plasticity;
        let [low, high] = plasticity.plastic_ratio_range;
        if !(0.0..1.0).contains(&critical_compression) || !(0.0..=1e3).contains(&critical_stretch) {
            return Some(format!(
                "critical compression is {critical_compression} and stretch {critical_stretch}: from 0 and below 1, and 0 to 1000 are needed"
            ));
        }

        if !(0.0..=40.0).contains(&hardening) {
            return Some(format!("hardening is {hardening}: 0 to 40 is needed"));
        }

        let ordered = above(low) && low <= 1.0 && (1.0..=1e3).contains(&high);
        (!ordered).then(|| {
            format!("the range of J_P is {low} to {high}: a lower end above 0 and at most 1, and an upper from 1 to 1000 are needed")
        })
    }

    const fn snow(young: f64, poisson: f64, critical_stretch: f64) -> Self {
        Self {
            law: Law::FixedCorotated,
            young,
            poisson,
            plasticity: Some(Plasticity {
                critical_compression: 2.5e-2,
                critical_stretch,
                hardening: 10.0,
                plastic_ratio_range: [0.6, 20.0],
            }),
        }
    }
}

impl Preset {
    /// Every preset, in the order of the documents.
    pub const ALL: [Self; 6] = [
        Self {
            name: "stomakhin",
            source: "Stomakhin et al. 2013, table 2: E0 1.4e5 Pa, nu 0.2, theta_c 2.5e-2, theta_s 7.5e-3, xi 10, rho0 400",
            density: 400.0,
            material: Material::snow(1.4e5, 0.2, 7.5e-3),
        },
        Self {
            name: "taichi_snow",
            source: "the values of Taichi's examples and of programs that follow them: theta_s 4.5e-3",
            density: 400.0,
            material: Material::snow(1.4e5, 0.2, 4.5e-3),
        },
        Self {
            name: "genesis_snow",
            source: "Genesis: E0 1e6 Pa, rho0 1000, theta_s 4.5e-3",
            density: 1000.0,
            material: Material::snow(1.0e6, 0.2, 4.5e-3),
        },
        Self {
            name: "newton_snowball",
            source: "Newton's snow ball: E0 1.4e6 Pa, nu 0.3; its yield law is another (cam-clay), here Stomakhin's",
            density: 400.0,
            material: Material::snow(1.4e6, 0.3, 7.5e-3),
        },
        Self {
            name: "elastic",
            source: "the snow of Stomakhin et al. 2013 without yield",
            density: 400.0,
            material: Material { law: Law::FixedCorotated, young: 1.4e5, poisson: 0.2, plasticity: None },
        },
        Self {
            name: "brasseur_neo_hookean",
            source: "Brasseur 2014, the alternative stress: Neo-Hookean, without yield",
            density: 400.0,
            material: Material { law: Law::NeoHookean, young: 1.4e5, poisson: 0.2, plasticity: None },
        },
    ];

    /// The preset of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name == name)
    }
}

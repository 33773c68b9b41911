//! How a run is stepped, of cloth or of snow.

use nappe_sim::math::Precision;

use super::{
    setting::{Plan, Setting, Steps},
    snow_setting::{SnowSetting, SnowSteps},
    split,
};
use crate::case::Case;

/// How a run is stepped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stepped {
    /// A scene of cloth.
    Cloth(Setting),
    /// A scene of snow alone.
    Snow(SnowSetting),
}

impl From<&Setting> for Stepped {
    fn from(setting: &Setting) -> Self {
        Self::Cloth(*setting)
    }
}

impl From<&SnowSetting> for Stepped {
    fn from(setting: &SnowSetting) -> Self {
        Self::Snow(*setting)
    }
}

impl From<&Self> for Stepped {
    fn from(stepped: &Self) -> Self {
        *stepped
    }
}

impl Stepped {
    /// The name of its method, or of its transfer with the kernel.
    pub fn name(&self) -> String {
        match self {
            Self::Cloth(setting) => setting.name(),
            Self::Snow(setting) => setting.variant.name(),
        }
    }

    /// The same as a reader writes it: `BDF2, Newton, controlled steps`, `MLS, quadratic kernel`, ...
    pub fn reader_name(&self) -> String {
        match self {
            Self::Cloth(Setting { method, steps: Steps::Controlled(_), .. }) => {
                format!("{}, controlled steps", method.reader_name())
            }
            Self::Cloth(setting) => setting.method.reader_name(),
            Self::Snow(setting) => setting.variant.reader_name(),
        }
    }

    /// Of positions and velocities.
    pub const fn precision(&self) -> Precision {
        match self {
            Self::Cloth(setting) => setting.precision,
            Self::Snow(setting) => setting.precision,
        }
    }

    /// Whether it is the scene as it is written.
    pub fn is_own(&self) -> bool {
        match self {
            Self::Cloth(setting) => setting.steps == Steps::Own,
            Self::Snow(setting) => setting.steps == SnowSteps::Own && setting.halvings == 0,
        }
    }

    /// The side of its cells (m), of snow.
    pub const fn cell(&self) -> Option<f64> {
        match self {
            Self::Cloth(_) => None,
            Self::Snow(setting) => Some(setting.cell),
        }
    }

    /// The error (m) per step that its steps are controlled by.
    pub const fn step_tolerance(&self) -> Option<f64> {
        match self {
            Self::Cloth(Setting { steps: Steps::Controlled(tolerance), .. }) => Some(*tolerance),
            Self::Cloth(_) | Self::Snow(_) => None,
        }
    }

    /// Whether its steps are all alike, whatever the state.
    pub const fn is_even(&self) -> bool {
        matches!(self, Self::Cloth(Setting { steps: Steps::Divided(_) | Steps::Fixed(_), .. }))
    }

    /// The length (s) of all steps in a comparison interval (s), where they are equal.
    pub(crate) fn dt(&self, interval: f64) -> Option<f64> {
        match self {
            Self::Cloth(setting) => setting.dt(interval),
            Self::Snow(_) => None,
        }
    }

    /// What a run of a case is built from, in which times are an interval (s) apart.
    pub(crate) fn plan(&self, case: &Case, interval: f64) -> Plan {
        match self {
            Self::Cloth(setting) => setting.plan(case, interval),
            Self::Snow(setting) => setting.plan(case, interval),
        }
    }

    /// Where the particles of the scene are, from where those of a run are (m).
    pub(crate) fn gathered(&self, positions: Vec<f64>) -> Vec<f64> {
        match self {
            Self::Cloth(_) => positions,
            Self::Snow(setting) => split::parents(positions, setting.halvings),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::{Method, Variant};

    /// Every method of cloth at even and at controlled steps, and every variant of snow.
    fn all() -> Vec<Stepped> {
        let cloth = Method::compared().into_iter().flat_map(|method| {
            [Steps::Divided(0), Steps::Controlled(1e-3)]
                .map(|steps| Stepped::Cloth(Setting::new(method, Precision::F64, steps)))
        });
        let snow = Variant::all().into_iter().map(|variant| {
            let (precision, steps) = (Precision::F64, SnowSteps::Share(0.9));
            Stepped::Snow(SnowSetting { variant, precision, cell: 0.1, steps, halvings: 0 })
        });
        cloth.chain(snow).collect()
    }

    #[test]
    fn methods_of_different_names_have_different_names_for_readers() {
        let all = all();
        for (place, one) in all.iter().enumerate() {
            for other in &all[place + 1..] {
                let [names, readers] = [one.name() == other.name(), one.reader_name() == other.reader_name()];
                assert_eq!(names, readers, "{} and {}", one.name(), other.name());
            }
        }
    }

    #[test]
    fn a_name_for_readers_is_in_words() {
        let names: Vec<_> = all().iter().map(Stepped::reader_name).collect();
        for name in [
            "velocity Verlet",
            "implicit midpoint, Newton",
            "BDF2, exact Hessian, controlled steps",
            "MLS, cubic kernel",
        ] {
            assert!(names.iter().any(|known| known == name), "{name} in {names:?}");
        }
        assert!(names.iter().all(|name| !name.contains('_')), "{names:?}");
    }
}

//! Contact of cloth with cloth: how it rubs, and whether crossings are counted.

use serde::{Deserialize, Serialize};

use crate::names::names;

/// Whether edges that cross triangles are counted at the end of each sub-step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum SurfaceCheck {
    /// They are not.
    #[default]
    Off,
    /// They are, exactly, and told; no step depends on it.
    Count,
}

names!(SurfaceCheck { Off: "off", Count: "count" });

/// How surfaces of cloth meet each other; the distance that they keep is the body's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceSettings {
    /// Coefficient of friction, 0 or more.
    pub friction: f64,
    /// How fast (m/s) thickness that was lost is given back, 0 or more.
    pub recovery: f64,
    /// Whether crossings are counted.
    pub surface: SurfaceCheck,
}

impl Default for SurfaceSettings {
    fn default() -> Self {
        Self {
            friction: Self::DEFAULT_FRICTION,
            recovery: Self::DEFAULT_RECOVERY,
            surface: SurfaceCheck::default(),
        }
    }
}

impl SurfaceSettings {
    /// The coefficient of friction of a scene that names none.
    pub const DEFAULT_FRICTION: f64 = 0.3;
    /// How fast (m/s) thickness is given back in a scene that does not say.
    pub const DEFAULT_RECOVERY: f64 = 0.1;
    /// The fastest (m/s) that a scene may ask for.
    pub const MOST_RECOVERY: f64 = 10.0;
}

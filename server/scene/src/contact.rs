//! How surfaces of cloth meet each other, as a table of a scene, whose keys have defaults.

use nappe_sim::cloth::{SurfaceCheck, SurfaceSettings};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::names;

#[derive(Deserialize, Serialize)]
#[serde(default)]
struct Text {
    friction: f64,
    #[serde(with = "names::surface_check")]
    surface: SurfaceCheck,
}

impl Default for Text {
    fn default() -> Self {
        let SurfaceSettings { friction, surface } = SurfaceSettings::default();
        Self { friction, surface }
    }
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(text: D) -> Result<SurfaceSettings, D::Error> {
    let Text { friction, surface } = Text::deserialize(text)?;
    Ok(SurfaceSettings { friction, surface })
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde asks for")]
pub(crate) fn serialize<S: Serializer>(contact: &SurfaceSettings, to: S) -> Result<S::Ok, S::Error> {
    let SurfaceSettings { friction, surface } = *contact;
    Text { friction, surface }.serialize(to)
}

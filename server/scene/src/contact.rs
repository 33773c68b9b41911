//! How surfaces of cloth meet each other, as a table of a scene, whose keys have defaults.

use nappe_sim::cloth::{SurfaceCheck, SurfaceSettings};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::names;

#[derive(Deserialize, Serialize)]
#[serde(default)]
struct Text {
    friction: f64,
    recovery: f64,
    #[serde(with = "names::surface_check")]
    surface: SurfaceCheck,
}

impl Default for Text {
    fn default() -> Self {
        let SurfaceSettings { friction, recovery, surface } = SurfaceSettings::default();
        Self { friction, recovery, surface }
    }
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(text: D) -> Result<Option<SurfaceSettings>, D::Error> {
    let Text { friction, recovery, surface } = Text::deserialize(text)?;
    Ok(Some(SurfaceSettings { friction, recovery, surface }))
}

#[expect(clippy::ref_option, reason = "serde hands over a reference to the field")]
pub(crate) fn serialize<S: Serializer>(contact: &Option<SurfaceSettings>, to: S) -> Result<S::Ok, S::Error> {
    let text = |SurfaceSettings { friction, recovery, surface }| Text { friction, recovery, surface };
    contact.map(text).serialize(to)
}

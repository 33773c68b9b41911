//! The air of a body as a table of a scene, whose keys have defaults.

use nappe_sim::cloth::Air;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

#[derive(Deserialize, Serialize)]
#[serde(default)]
struct Text {
    density: f64,
    normal: f64,
    lift: f64,
    tangential: f64,
}

impl Default for Text {
    fn default() -> Self {
        let Air { density, normal, lift, tangential } = Air::default();
        Self { density, normal, lift, tangential }
    }
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(text: D) -> Result<Option<Air>, D::Error> {
    let Text { density, normal, lift, tangential } = Text::deserialize(text)?;
    Ok(Some(Air { density, normal, lift, tangential }))
}

#[expect(clippy::ref_option, reason = "serde hands over a reference to the field")]
pub(crate) fn serialize<S: Serializer>(air: &Option<Air>, to: S) -> Result<S::Ok, S::Error> {
    let text = |Air { density, normal, lift, tangential }| Text { density, normal, lift, tangential };
    air.map(text).serialize(to)
}

//! A figure as it is written in a scene: a mesh whose points go by frames, and which cloth with a thickness meets.
//!
//! Ranges, units and defaults stand in `keys`, against which a text is checked before serde sees it.

use nappe_sim::cloth::{FIRMNESS, Repeat};
use serde::{Deserialize, Serialize};

use crate::{body::Mesh, names, transform::Transform};

/// A body that frames lead.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Name, unique among bodies and figures.
    pub name: String,
    /// Red, green and blue of sRGB, each 0 to 1, for viewers; none: they choose one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<[f64; 3]>,
    /// Its triangles, and how many points it has; where they are, its frames say.
    pub mesh: Mesh,
    /// Moves all its frames.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub transform: Transform,
    /// Distance (m) that it keeps from cloth, half of which counts as that of a body does.
    pub thickness: f64,
    /// Pressure (N) on each square metre by which it gives way by 1 m (N/m³).
    #[serde(default = "firmness")]
    pub firmness: f64,
    /// Where its points are over time.
    pub frames: FigureFrames,
    /// When its first frame passes (s): until then it holds.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub start: f64,
}

const fn firmness() -> f64 {
    FIRMNESS
}

/// Where the points of a figure are over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FigureFrames {
    /// Where the frames come from.
    #[serde(flatten)]
    pub source: FramesSource,
    /// Frames in a second (1/s).
    pub rate: f64,
    /// What follows the last one.
    #[serde(default, with = "names::repeat", skip_serializing_if = "names::is_default")]
    pub repeat: Repeat,
}

/// Where frames come from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FramesSource {
    /// A PC2 file beside the scene, by its path, relative to the scene's folder.
    File(String),
    /// Uploaded frames, by the id that the server gave to them.
    Upload(String),
}

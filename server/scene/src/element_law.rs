//! A law of elements as it is written in a scene: which one, how stiff, and where the warp of a fabric runs.
//!
//! Ranges, units and defaults stand in `keys`, against which a text is checked before serde sees it.

use nappe_sim::cloth::ElementKind;
use serde::{Deserialize, Serialize};

use crate::names;

/// A law of elements, and how strongly it acts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ElementLaw {
    /// The law, by its name in the list of laws.
    #[serde(with = "names::element_law")]
    pub name: ElementKind,
    /// Stiffness, in the unit of the law.
    pub stiffness: Stiffness,
    /// Damping, in seconds times that unit; of several stiffnesses that of the greatest, of the others in proportion.
    #[serde(default)]
    pub damping: f64,
    /// Where the warp runs, of a membrane.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warp: Option<WarpText>,
}

/// Stiffness of a law of elements.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Stiffness {
    /// One for all that it resists.
    One(f64),
    /// Of a membrane along the warp, along the weft and against shear (N/m).
    Three([f64; 3]),
}

/// Where the warp of a membrane runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum WarpText {
    /// A direction that a name stands for.
    Named(NamedWarp),
    /// A direction in the transformed mesh, projected into each triangle.
    Direction([f64; 3]),
}

/// Where the warp of a membrane runs, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NamedWarp {
    /// Along the first texture coordinate.
    Uv,
}

impl NamedWarp {
    /// Names in scene files.
    pub const NAMES: [&str; 1] = ["uv"];
}

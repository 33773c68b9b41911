//! A term of a scene: its name, and what is removed with it.

use nappe_sim::cloth::{ElementKind, SpringKind};

/// A part of what a scene states that can be removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Removal {
    /// All springs of a kind; those of stretch stay.
    Springs(SpringKind),
    /// The damping of all springs of a kind.
    Damping(SpringKind),
    /// The elements of a law of a body, which is known by its place.
    Elements(usize, ElementKind),
    /// The damping of the elements of a law of a body.
    ElementDamping(usize, ElementKind),
    /// The damping of the fabric of a body.
    FabricDamping(usize),
    /// The thickness of a body, by its place: its surface passes through itself then.
    Thickness(usize),
    /// The friction between surfaces of cloth.
    SurfaceFriction,
    /// The drag of the medium on all bodies of cloth.
    Drag,
    /// The drag of the medium on all snow.
    SnowDrag,
    /// The air around all bodies.
    Air,
    /// The motion of the medium.
    Wind,
    /// A collider, by its place.
    Collider(usize),
    /// The friction of a collider.
    Friction(usize),
    /// The restitution of a collider.
    Restitution(usize),
    /// The yield of all snow, which is elastic then.
    Plasticity,
    /// The hardening of all snow that yields.
    Hardening,
    /// The noise on the density of all snow.
    DensityNoise,
    /// The noise on the stiffness of all snow.
    StiffnessNoise,
    /// The share of FLIP: all velocities come from the grid then, as in PIC.
    Flip,
    /// Half of the digits: f64 becomes f32.
    Digits,
}

/// A term of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneTerm {
    /// In words: `springs of bend`, `friction of table`.
    pub name: String,
    /// What is removed with it.
    pub removal: Removal,
}

impl SceneTerm {
    pub(super) fn new(name: impl Into<String>, removal: Removal) -> Self {
        Self { name: name.into(), removal }
    }
}

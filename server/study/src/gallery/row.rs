//! What rows of a table have in common.

use nappe_sim::cloth::{ClothSettings, Network};

use super::{finding::Finding, scene::Scene};
use crate::method::Method;

/// Of every scene that hangs or falls (m/s²).
pub(super) const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];

/// A row of a table: a scene, over methods of a kind.
pub(super) struct Row<M> {
    /// By which the scene is known.
    pub(super) number: u32,
    /// What it is.
    pub(super) what: &'static str,
    /// What becomes of a method in it.
    pub(super) run: fn(M) -> Finding,
}

/// The scene of a network with a step of `dt`, in the settings that a scene has that says nothing but its method.
pub(super) fn stepped(network: Network, dt: f64, method: Method) -> Scene {
    let mut scene = Scene::new(network, dt);
    scene.settings = ClothSettings::default();
    scene.by(method)
}

//! What scenes of the table have in common.

use nappe_sim::cloth::{ClothSettings, Network};
use nappe_tests::{Method, Scene};

use crate::verdict::Verdict;

/// Of every scene that hangs or falls (m/s²).
pub(super) const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];

/// A row of the table.
pub(super) struct SceneOfTable {
    /// By which the scene is known.
    pub(super) number: u32,
    /// What it is.
    pub(super) what: &'static str,
    /// What becomes of a method in it.
    pub(super) run: fn(Method) -> Verdict,
}

/// The scene of a network with a step of `dt`, in the settings that a scene has that says nothing but its method.
pub(super) fn stepped(network: Network, dt: f64, method: Method) -> Scene {
    let mut scene = Scene::new(network, dt);
    scene.settings = ClothSettings::default();
    scene.by(method)
}

//! Cases of studies, from networks.

use nappe_sim::{
    cloth::{ClothSettings, Network},
    math::Precision,
    world::{BodySetup, WorldSetup},
};
use nappe_study::Case;

/// A cloth under gravity (m/s²), in steps of the world of `dt` (s).
pub(crate) fn case(network: Network, gravity: [f64; 3], dt: f64) -> Case {
    let body = BodySetup { name: "cloth".to_owned(), network, settings: ClothSettings::default() };
    let (wind, colliders) = ([0.0; 3], Vec::new());
    let setup = WorldSetup { dt, gravity, wind, colliders, bodies: vec![body], snow: None };
    Case::new("cloth", setup, Vec::new(), Precision::F64).expect("a cloth")
}

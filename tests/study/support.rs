//! Cases of studies, from networks.

use nappe_sim::{
    cloth::{ClothSettings, Network},
    math::Precision,
    world::{BodySetup, Change, WorldSetup},
};
use nappe_study::Case;

/// A cloth under gravity (m/s²), in steps of the world of `dt` (s).
pub(crate) fn case(network: Network, gravity: [f64; 3], dt: f64) -> Case {
    case_with(network, gravity, dt, Vec::new())
}

/// The same with changes before the first step.
pub(crate) fn case_with(network: Network, gravity: [f64; 3], dt: f64, changes: Vec<Change>) -> Case {
    let body = BodySetup {
        name: "cloth".to_owned(),
        network,
        settings: ClothSettings::default(),
        forces: Vec::new(),
    };
    let (wind, colliders) = ([0.0; 3], Vec::new());
    let setup =
        WorldSetup { dt, gravity, wind_at: Vec::new(), wind, colliders, bodies: vec![body], snow: None };
    Case::new("cloth", setup, changes, Precision::F64).expect("a cloth")
}

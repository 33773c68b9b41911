//! Test support: golden data, fixtures, closed forms, and the axes that tables of tests run over.
//!
//! Suites take from here; nothing here asserts on the program except that it runs.

pub mod threads;
pub mod course;
pub mod golden;
pub mod meshes;
pub mod flat;
pub mod ranks;
pub mod scene;
mod random;

pub mod sheets;
pub mod numbering;
pub mod crossings;
pub mod surface;
pub mod snow;
pub mod statics;
pub mod systems;
pub mod at_random;

mod oscillator;
mod scalar;

pub use nappe_study::{Method, NEWTON, gallery::networks};
pub use oscillator::Oscillator;
pub use random::Random;
pub use scalar::ScalarLaw;
pub use scene::Scene;

/// The Rust blocks of docs/STYLE.md, compiled and run as doctests.
#[doc = include_str!("../../docs/STYLE.md")]
pub mod style {}

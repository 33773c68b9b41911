//! What a scene file may hold: every key with its unit, default, range and meaning, section by section.
//!
//! [`page`] writes them as the reference in docs/scenes.md, [`unit`] finds one of them. Modules in reading order:

mod body;
mod figure;
mod snow;
mod scene;
mod page;
mod unit;

pub use page::page;
pub(crate) use scene::ROOT;
pub use unit::unit;

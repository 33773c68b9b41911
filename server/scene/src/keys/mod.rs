//! What a scene file may hold: every key with its unit, default, range and meaning, section by section.
//!
//! [`page`] writes them as the reference in docs/scenes.md. Modules in reading order:

mod body;
mod snow;
mod scene;
mod page;

pub use page::page;
pub(crate) use scene::ROOT;

//! The language in which the scene format is written down, and the check of a text against it.
//!
//! One table of keys serves three purposes: [`check`] refuses what does not fit, messages say what is
//! allowed, and the reference in docs/scenes.md is written from it.

mod range;
mod key;
mod check;

pub(crate) use check::check;
pub(crate) use key::{Alternative, Alternatives, Presence, Section, ValueKind, key};
pub(crate) use range::{DIRECTION, LENGTH, Range, SIZE, SPEED, WELD};

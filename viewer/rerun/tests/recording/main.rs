//! A recording holds what it was given: entities, timelines, every frame, a layout; and errors say what is wrong.
//! One program for all, since each would link the viewer's SDK.

mod recorded;
mod cloth;
mod snow;
mod poses;
mod forces;

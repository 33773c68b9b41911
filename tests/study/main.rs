//! Methods compared on a scene: references and errors against golden data, windows, rows that nothing changes.

mod support;
mod golden;
mod window;
mod rows;

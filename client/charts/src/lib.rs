//! Pictures of a study, as SVG and PNG: the only crate that names the plotter.
//!
//! Reads a chart; writes pictures, each with a sentence made from its rows. Errors and lengths are drawn in millimetres. Modules
//! in reading order:

mod picture;
mod look;
mod canvas;
mod labels;
mod words;
mod lines;
mod work_precision;
mod convergence;
mod window;

pub use picture::Picture;

use nappe_study::Chart;

/// What a chart shows, for those that it has rows or times for.
///
/// # Errors
/// What the plotter cannot make pixels of.
pub fn pictures(scene: &str, chart: &Chart) -> Result<Vec<Picture>, String> {
    let mut pictures = Vec::new();
    if chart.rows.iter().any(|row| row.error().is_some()) {
        pictures.push(work_precision::picture(scene, chart)?);
        pictures.push(convergence::picture(scene, chart)?);
    }
    if !chart.scan.spread.is_empty() {
        pictures.push(window::picture(scene, chart)?);
    }
    Ok(pictures)
}

//! Pictures of studies, as SVG and PNG: the only crate that names the plotter.
//!
//! Reads a chart, a study of stability, the gallery, a sweep, or a profile of several scenes; writes pictures in a style, each with a
//! sentence made from its rows. Errors and lengths are drawn in millimetres. Modules in reading order:

mod picture;
mod style;
mod look;
mod page;
mod key;
mod canvas;
mod labels;
mod words;
mod lines;
mod work_precision;
mod convergence;
mod window;
mod sheet;
mod scale;
mod axes;
mod hatch;
mod bars;
mod limits;
mod verdicts;
mod panels;
mod map;
mod gallery;
mod terms;
mod profile;
mod sweep;

pub use gallery::picture as gallery_picture;
pub use picture::Picture;
pub use profile::picture as profile_picture;
pub use style::Style;
pub use sweep::{Sweep, SweepRun, picture as sweep_picture};

use nappe_study::{Chart, Map, Plan, Stability};

/// What a chart shows, for those that it has rows or times for.
///
/// # Errors
/// What the plotter cannot make pixels of.
pub fn pictures(scene: &str, chart: &Chart, style: &Style) -> Result<Vec<Picture>, String> {
    let mut pictures = Vec::new();
    if chart.rows.iter().any(|row| row.error().is_some()) {
        pictures.push(work_precision::picture(scene, chart, style)?);
    }
    // Steps of snow alone converge to nothing.
    if chart.rows.iter().any(|row| row.stepped.is_even() && row.error().is_some()) {
        pictures.push(convergence::picture(scene, chart, style)?);
    }
    if window::is_known(chart) {
        pictures.push(window::picture(scene, chart, style)?);
    }
    Ok(pictures)
}

/// What a plan shows, if anything was tried: the rows with a ring around that which is recommended, and what can go.
///
/// # Errors
/// What the plotter cannot make pixels of.
pub fn plan_pictures(scene: &str, plan: &Plan, style: &Style) -> Result<Vec<Picture>, String> {
    if plan.chart.rows.iter().all(|row| row.error().is_none()) {
        return Ok(Vec::new());
    }
    let mut pictures = vec![work_precision::planned(scene, plan, style)?];
    if plan.terms.iter().any(|term| term.change.is_some()) {
        pictures.push(terms::picture(scene, plan, style)?);
    }
    Ok(pictures)
}

/// What a study of stability shows: the limits of methods, and the maps, of which it has rows.
///
/// # Errors
/// What the plotter cannot make pixels of.
pub fn stability_pictures(scene: &str, stability: &Stability, style: &Style) -> Result<Vec<Picture>, String> {
    let mut pictures = Vec::new();
    if bars::longest(stability, bars::drawn(stability)) > 0.0 {
        pictures.push(limits::picture(scene, stability, style)?);
    }
    for map in Map::ALL {
        if stability.rows.iter().any(|row| panels::has(map, row)) {
            pictures.push(map::picture(scene, stability, map, style)?);
        }
    }
    Ok(pictures)
}

//! What colliders feel to time series: the force along each axis (N), of all colliders in one plot.
//!
//! Enters: colliders once, then `v1::Diagnostics`. Leaves: one row of scalars for each collider.

use nappe_client::{Collider, v1};

use crate::{
    body::entity_name,
    error::{RerunError, refused},
    plots::{BLUE, GREEN, RED},
    sdk::{Color, RecordingStream, Scalars, SeriesLines},
};

/// Where the series are.
pub(crate) const LOADS: &str = "plots/loads";
/// Colours of the axes.
const AXES: [(&str, [u8; 3]); 3] = [("x", RED), ("y", GREEN), ("z", BLUE)];

fn path(name: &str, index: usize) -> String {
    format!("{LOADS}/{}", entity_name(name, index))
}

/// Logs names and colours of all series, once.
pub(crate) fn describe(stream: &RecordingStream, colliders: &[Collider]) -> Result<(), RerunError> {
    for (index, Collider { name, .. }) in colliders.iter().enumerate() {
        let names = AXES.map(|(axis, _)| format!("{name} {axis}"));
        let colors = AXES.map(|(_, [red, green, blue])| Color::from_rgb(red, green, blue));
        let lines = SeriesLines::new().with_names(names).with_colors(colors);
        let path = path(name, index);
        stream.log_static(&*path, &lines).map_err(refused(&path))?;
    }
    Ok(())
}

/// Logs what colliders felt in a step at the stream's current time. Forces that are not finite leave a gap.
pub(crate) fn log(stream: &RecordingStream, diagnostics: &v1::Diagnostics) -> Result<(), RerunError> {
    for (index, load) in diagnostics.loads.iter().enumerate() {
        let v1::Vector3 { x, y, z } = load.force.unwrap_or_default();
        if [x, y, z].iter().all(|component| component.is_finite()) {
            let path = path(&load.name, index);
            stream.log(&*path, &Scalars::new([x, y, z])).map_err(refused(&path))?;
        }
    }
    Ok(())
}

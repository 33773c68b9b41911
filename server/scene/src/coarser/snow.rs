//! Snow on larger cells, with as many particles per cell: each stands for a larger share of the same solids.

use super::edits::Edits;
use crate::{snow::Snow, source::Path};

/// Makes snow coarser; `at` is where it stands.
pub(super) fn edit(snow: &Snow, by: u32, at: &Path, edits: &mut Edits<'_>) {
    edits.scaled(at.key("cell"), snow.cell, f64::from(by));
    for (place, object) in snow.objects.iter().enumerate() {
        if let Some(particles) = object.particles {
            let share = (f64::from(particles) / f64::from(by).powi(3)).round().max(1.0);
            edits.whole(at.key("object").index(place).key("particles"), share as u32);
        }
    }
}

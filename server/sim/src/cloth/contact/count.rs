//! Counts the edges that cross triangles at the end of a sub-step, exactly.

use super::ways::wide;
use crate::{
    cloth::layout::Surface,
    math::{Padded, Real},
    surface::Crossings,
};

/// Memory of the count.
#[derive(Clone, Debug, Default)]
pub(crate) struct Count(Option<Crossings>);

impl Count {
    /// How many edges cross triangles with particles at these positions (m).
    pub(crate) fn of<R: Real>(&mut self, surface: &Surface, x: &[Padded<R>]) -> u64 {
        let crossings = self.0.get_or_insert_with(|| Crossings::new(&surface.faces));
        crossings.count(&surface.faces, &|particle| wide(&x[particle as usize])).0
    }
}

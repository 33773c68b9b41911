//! Counts the edges that cross triangles at the end of a sub-step, exactly.

use super::ways::wide;
use crate::{
    cloth::layout::Surface,
    interrupt::{Interrupt, Interrupted},
    math::{Padded, Real},
    surface::Crossings,
};

/// Memory of the count.
#[derive(Clone, Debug, Default)]
pub(crate) struct Count(Option<Crossings>);

impl Count {
    /// How many edges cross triangles with particles at these positions (m), unless the count is given up.
    pub(crate) fn of<R: Real>(
        &mut self,
        surface: &Surface,
        x: &[Padded<R>],
        interrupt: &Interrupt,
    ) -> Result<u64, Interrupted> {
        let crossings = self.0.get_or_insert_with(|| Crossings::new(&surface.faces));
        let place = |particle: u32| wide(&x[particle as usize]);
        crossings.count(&surface.faces, &place, interrupt).map(|(count, _)| count)
    }
}

//! Counts the edges that cross triangles at the end of a sub-step, exactly.

use super::ways::wide;
use crate::{
    cloth::layout::Surface,
    math::{Padded, Real},
    surface::{Tree, crossings},
};

/// Memory of the count.
#[derive(Clone, Debug, Default)]
pub(crate) struct Count(Option<Tree>);

impl Count {
    /// How many edges cross triangles with particles at these positions (m).
    pub(crate) fn of<R: Real>(&mut self, surface: &Surface, x: &[Padded<R>]) -> u64 {
        let tree = self.0.get_or_insert_with(|| Tree::new(surface.faces.triangles().len()));
        crossings(&surface.faces, tree, &|particle| wide(&x[particle as usize])).0
    }
}

//! A grid or a chain with fewer particles over the same length: how many, how far apart, and which lie where.

use crate::body::Mesh;

/// A grid, and a coarser one in its place. A chain is a grid of one row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoarserGrid {
    /// Columns and rows of the grid as it is.
    pub fine: [u32; 2],
    /// Columns and rows of the coarser one.
    pub coarse: [u32; 2],
}

impl CoarserGrid {
    /// A grid that is coarser by a whole number, 2 or more. Where that divides the gaps between particles along both sides, every
    /// particle of the coarser grid has the place of one of the fine grid. Where it divides the particles in place of the gaps, the
    /// corners have. None where it does neither.
    pub fn new(fine: [u32; 2], by: u32) -> Option<Self> {
        let by_gaps = |count: u32| match count {
            0 | 1 => Some(count),
            _ => (count - 1).is_multiple_of(by).then(|| (count - 1) / by + 1),
        };
        let by_particles = |count: u32| match count {
            0 | 1 => Some(count),
            _ => (count.is_multiple_of(by) && count / by >= 2).then(|| count / by),
        };
        let both = |along: &dyn Fn(u32) -> Option<u32>| Some([along(fine[0])?, along(fine[1])?]);
        let coarse = both(&by_gaps).or_else(|| both(&by_particles))?;
        (by >= 2 && coarse != fine).then_some(Self { fine, coarse })
    }

    /// Columns and rows of a mesh that is a grid or a chain.
    pub(super) fn sides(mesh: &Mesh) -> Option<[u32; 2]> {
        match *mesh {
            Mesh::Grid { grid, .. } => Some(grid),
            Mesh::Chain { chain, .. } => Some([chain, 1]),
            Mesh::CourseGrid { .. } | Mesh::Upload { .. } | Mesh::File { .. } => None,
        }
    }

    /// The grid of a mesh and the one of its coarser copy; none where a mesh is no grid and no chain.
    pub fn between(fine: &Mesh, coarse: &Mesh) -> Option<Self> {
        Some(Self { fine: Self::sides(fine)?, coarse: Self::sides(coarse)? })
    }

    /// Whether it is extended along columns and along rows.
    pub(super) fn extended(self) -> [bool; 2] {
        self.fine.map(|count| count > 1)
    }

    /// Gaps of the fine grid in one of the coarse grid, along columns and along rows; 1 where there is none.
    pub fn gaps(self) -> [f64; 2] {
        [0, 1].map(|axis| {
            let [fine, coarse] =
                [self.fine, self.coarse].map(|counts| f64::from(counts[axis].saturating_sub(1)));
            if coarse > 0.0 { fine / coarse } else { 1.0 }
        })
    }

    /// The factor of the spacing. Where columns and rows ask for different ones, and pins hold the ends of one of them alone, the
    /// length of that one stays; else the area stays.
    pub(super) fn spacing(self, held: [bool; 2]) -> f64 {
        let [columns, rows] = self.gaps();
        let deciding = if self.extended() == [true, true] { held } else { self.extended() };
        match deciding {
            [true, false] => columns,
            [false, true] => rows,
            // The root of their product may be off by a rounding.
            _ if columns == rows => columns,
            _ => (columns * rows).sqrt(),
        }
    }

    /// The particle of the coarse grid at the place of one of the fine grid, where there is one.
    pub fn coarse_particle(self, particle: u32) -> Option<u32> {
        let columns = self.fine[0].max(1);
        let along = |place: u32, axis: usize| {
            let [fine, coarse] =
                [self.fine, self.coarse].map(|counts| u64::from(counts[axis].saturating_sub(1)));
            let place = u64::from(place);
            match fine {
                0 => (place == 0).then_some(0),
                _ => (place <= fine && (place * coarse).is_multiple_of(fine)).then(|| place * coarse / fine),
            }
        };
        let (column, row) = (along(particle % columns, 0)?, along(particle / columns, 1)?);
        u32::try_from(row * u64::from(self.coarse[0]) + column).ok()
    }
}

//! What every reader gives.

use nappe_sim::mesh::TriangleMesh;

/// A mesh that was read, and what is odd about its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loaded {
    /// The mesh as the file has it.
    pub mesh: TriangleMesh,
    /// What is odd and was ignored.
    pub warnings: Vec<String>,
}

/// How often something odd was met in a file, and where first: a line, or the index of a face.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Met {
    pub(super) count: usize,
    pub(super) first: usize,
}

impl Met {
    /// Counts what was met at `place`; places come in the order of the file.
    pub(super) fn add(&mut self, place: usize) {
        if self.count == 0 {
            self.first = place;
        }
        self.count += 1;
    }
}

/// A polygon as a fan of triangles from its first corner.
pub(super) fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let first = corners.first().copied().unwrap_or(0);
    corners.windows(2).skip(1).map(move |pair| [first, pair[0], pair[1]])
}

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

/// A polygon as a fan of triangles from its first corner.
pub(super) fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let first = corners.first().copied().unwrap_or(0);
    corners.windows(2).skip(1).map(move |pair| [first, pair[0], pair[1]])
}
